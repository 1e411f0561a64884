package flyframe

/** Numbers on the command line of a long run: variables of make that are none end it with a sentence. */
object Numbers {

  /** @param names
    *   of the variables, in the order of the arguments; each is 1 at least
    */
  def of(arguments: Seq[String], names: String*): Seq[Long] =
    parse(arguments, names) match {
      case Right(numbers) => numbers
      case Left(sentence) =>
        System.err.println(sentence)
        sys.exit(2)
    }

  private[flyframe] def parse(arguments: Seq[String], names: Seq[String]): Either[String, Seq[Long]] =
    if (arguments.size != names.size)
      Left(s"${names.mkString(" and ")} must be given, but there are ${arguments.size} arguments.")
    else {
      val numbers = arguments.map(_.toLongOption.filter(_ > 0))
      names
        .zip(arguments)
        .zip(numbers)
        .collectFirst { case ((name, text), None) =>
          s"$name must be a whole number from 1 on, but is '$text'."
        }
        .toLeft(numbers.flatten)
    }
}
