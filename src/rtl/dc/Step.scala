package flyframe.dc

/** What [[WordEngine]] does in one round: adds two words byte by byte, lowest first, and goes on. */
sealed trait Step

/** The first operand of a step. */
sealed trait First
object First {
  case object Zero extends First

  /** The local time at the beginning of the round. */
  case object Time extends First

  /** A word of the engine.
    *
    * @param indexed
    *   its number is `number` and the index of the request
    */
  final case class Word(number: Int, indexed: Boolean = false) extends First
}

/** The second operand of a step. */
sealed trait Second
object Second {
  case object Zero extends Second

  /** A word of the engine, of which byte i + `up` stands at place i; behind its end it goes on with its sign,
    * in front of its beginning with 0.
    */
  final case class Word(number: Int, up: Int = 0, indexed: Boolean = false) extends Second {
    require(up >= -4 && up <= 4, s"up is $up but must be -4 to 4.")
  }

  /** What bus or host have written to the eight bytes from `address` on, of which byte i + `up` stands at
    * place i; `half`: only the lower four of the operand, else 0.
    */
  final case class Setting(address: Int, up: Int = 0, half: Boolean = false) extends Second {
    require(
      address % 8 == 0 && address >> 8 == 0x9,
      f"address is 0x$address%04x but must be a multiple of 8 in 0x0900 to 0x09f8."
    )
  }

  /** A number of 16 bits from outside or a constant, at places 0 and 1, or `low` places higher. */
  final case class Input(number: Int, low: Int = 0) extends Second
}

/** The places of a result that are stored. */
object Places {
  val All: Int   = 0 // all eight
  val Upper: Int = 1 // 4 to 7
  val Speed: Int = 2 // 2 and 3
  val Rest: Int  = 3 // 1 to 7
}

/** `first` + `second`, or less it.
  *
  * @param to
  *   word of the engine that takes the result; None: only `command` and conditions
  * @param toIndexed
  *   its number is `to` and the index of the request
  * @param places
  *   those of [[Places]] that it takes
  * @param narrow
  *   the result is the lower four bytes with their sign
  * @param command
  *   number of what happens behind it
  * @param repeats
  *   it is done as often as the counter says
  */
final case class Add(
    first: First,
    second: Second,
    to: Option[Int] = None,
    toIndexed: Boolean = false,
    subtract: Boolean = false,
    places: Int = Places.All,
    narrow: Boolean = false,
    command: Int = 0,
    repeats: Boolean = false
) extends Step

/** Goes on at `label` if the condition of this number is `when`, else with the next step.
  *
  * @param condition
  *   one of [[WordEngine.Condition]], or behind them one from outside
  */
final case class Branch(label: String, condition: Int = WordEngine.Condition.Always, when: Boolean = true)
    extends Step

/** The task is done. */
case object End extends Step

/** Steps with the labels of some of them. */
final case class Program(lines: Seq[(String, Seq[Step])]) {
  val steps: Seq[Step] = lines.flatMap(_._2)

  private val places: Map[String, Int] = {
    val starts = lines.scanLeft(0)(_ + _._2.size)
    val labels = lines.map(_._1)
    for (label <- labels.diff(labels.distinct))
      require(requirement = false, s"label $label stands in several places but must stand in 1.")
    labels.zip(starts).toMap
  }

  /** Where `label` stands. */
  def apply(label: String): Int = places.getOrElse(
    label,
    throw new IllegalArgumentException(s"label is $label but must be one of ${places.keys.mkString(", ")}.")
  )
}

/** A step as the memory of the program has it: one word of fields, from the lowest bit up. */
private[dc] object Code {

  /** A field of so many bits from `low` on. */
  final case class Field(low: Int, bits: Int) {
    def of(value: Int): BigInt = {
      require(value >= 0 && value >> bits == 0, s"value is $value but must have $bits bits.")
      BigInt(value) << low
    }
  }
  private def behind(field: Field, bits: Int) = Field(field.low + field.bits, bits)
  val Kind: Field                             = Field(0, 2)
  val Command: Field                          = behind(Kind, 4)
  val First: Field                            = behind(Command, 2)
  val Word: Field                             = behind(First, 5)
  val Second: Field                           = behind(Word, 3)
  val Other: Field                            = behind(Second, 5)
  val Up: Field                               = behind(Other, 4)
  val Subtract: Field                         = behind(Up, 1)
  val Narrow: Field                           = behind(Subtract, 1)
  val Places: Field                           = behind(Narrow, 3)
  val To: Field                               = behind(Places, 5)
  val ToIndexed: Field                        = behind(To, 1)
  val Width: Int                              = ToIndexed.low + ToIndexed.bits

  // Of a branch, in the place of operands.
  val Target: Field    = Field(Other.low, Other.bits + Up.bits)
  val Condition: Field = Field(Word.low, Word.bits - 1)
  val When: Field      = Field(Word.low + Word.bits - 1, 1)

  /** Values of [[Kind]]: an addition, the same again and again, a branch, the end. */
  object Kinds {
    val Add     = 0
    val Repeats = 1
    val Branch  = 2
    val End     = 3
  }

  /** Values of [[First]]. */
  object Firsts {
    val Zero    = 0
    val Time    = 1
    val Word    = 2
    val Indexed = 3
  }

  /** Values of [[Second]]. */
  object Seconds {
    val Zero    = 0
    val Word    = 1
    val Indexed = 2
    val Setting = 3
    val Half    = 4
    val Input   = 5
  }

  /** [[Places]] has 0 where nothing is stored, else this more than those of the step. */
  val Stores: Int = 1

  def apply(program: Program, step: Step): BigInt = step match {
    case End => Kind.of(Kinds.End)
    case Branch(label, condition, wanted) =>
      Kind.of(Kinds.Branch) + Target.of(program(label)) + Condition.of(condition) + When.of(one(wanted))
    case add: Add =>
      val first = add.first match {
        case flyframe.dc.First.Zero => First.of(Firsts.Zero)
        case flyframe.dc.First.Time => First.of(Firsts.Time)
        case flyframe.dc.First.Word(number, index) =>
          First.of(if (index) Firsts.Indexed else Firsts.Word) + Word.of(number)
      }
      Kind.of(if (add.repeats) Kinds.Repeats else Kinds.Add) + Command.of(add.command) + first +
        second(add.second) + Subtract.of(one(add.subtract)) + Narrow.of(one(add.narrow)) +
        add.to.fold(BigInt(0))(to => Places.of(add.places + Stores) + To.of(to)) +
        ToIndexed.of(one(add.toIndexed))
  }
  private def one(on: Boolean): Int = if (on) 1 else 0

  private def second(operand: Second): BigInt = {
    val (kind, other, up) = operand match {
      case flyframe.dc.Second.Zero => (Seconds.Zero, 0, 0)
      case flyframe.dc.Second.Word(number, up, index) =>
        (if (index) Seconds.Indexed else Seconds.Word, number, up)
      case flyframe.dc.Second.Setting(address, up, half) =>
        (if (half) Seconds.Half else Seconds.Setting, (address & 0xff) / 8, up)
      case flyframe.dc.Second.Input(number, low) => (Seconds.Input, number, -low)
    }
    Second.of(kind) + Other.of(other) + Up.of(up & 0xf)
  }
}
