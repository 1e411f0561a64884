package flyframe

import java.nio.file.{Files, Path, Paths, StandardCopyOption}
import scala.jdk.CollectionConverters._
import scala.sys.process._
import scala.util.Using
import chiseltest.simulator._
import com.sun.jna.{Library, NativeLibrary, Pointer}
import firrtl2.options.TargetDirAnnotation
import firrtl2.{CircuitState, bitWidth, ir}

/** Verilator as chiseltest builds it, but called directly: chiseltest calls each peek, poke and step through
  * JNA, which takes ten times as long as most of them do, and evaluates each cycle once more than it needs.
  */
case object DirectSimulation extends SimulatorAnnotation {
  override def getSimulator: Simulator = Direct

  private object Direct extends Simulator {
    private val verilator        = VerilatorBackendAnnotation.getSimulator
    override def name            = verilator.name
    override def isAvailable     = verilator.isAvailable
    override def waveformFormats = verilator.waveformFormats
    override def createContext(state: CircuitState): SimulatorContext = {
      verilator.createContext(state).finish() // it has built the library, or found it
      val folder = state.annotations.collectFirst { case TargetDirAnnotation(d) => Paths.get(d) }.get
      val main   = state.circuit.modules.find(_.name == state.circuit.main).get
      new DirectContext(folder.resolve("verilated").resolve(s"V${main.name}"), main.ports, this)
    }
  }
}

/** One simulation. Its functions know ports by their number: inputs first, then outputs, without the clock.
  */
private final class DirectContext(built: Path, ports: Seq[ir.Port], val sim: Simulator)
    extends SimulatorContext {
  private case class Pin(id: Int, width: Int, signed: Boolean) {
    val words = (width + 63) / 64
    val all   = (BigInt(1) << width) - 1
  }
  private val pins: Map[String, Pin] = {
    val (in, out) = ports
      .filterNot(p => p.tpe == ir.ClockType && p.direction == ir.Input)
      .filter(p => bitWidth(p.tpe) > 0)
      .partition(_.direction == ir.Input)
    (in ++ out).zipWithIndex.map { case (p, id) =>
      p.name -> Pin(id, bitWidth(p.tpe).toInt, p.tpe.isInstanceOf[ir.SIntType])
    }.toMap
  }

  // A copy: one that is built anew while this one runs does not change it.
  private val library = {
    val copy = Files.createTempFile("simulation", ".so")
    try {
      Files.copy(built, copy, StandardCopyOption.REPLACE_EXISTING)
      // Bound at once and seen by nobody else (RTLD_NOW): all have functions of the same names.
      NativeLibrary.getInstance(copy.toString, Map(Library.OPTION_OPEN_FLAGS -> 2).asJava)
    } finally Files.delete(copy)
  }
  private def address(name: String)       = Pointer.nativeValue(library.getFunction(name))
  private val Seq(stepAt, updateAt)       = Seq("step", "update").map(address)
  private val Seq(peekAt, pokeAt)         = Seq("peek", "poke").map(address)
  private val Seq(peekWideAt, pokeWideAt) = Seq("peek_wide", "poke_wide").map(address)
  private val state = Pointer.nativeValue(library.getFunction("sim_init").invokePointer(Array.empty[AnyRef]))
  private val calls = DirectCalls.loaded
  private var stale = true
  private var running = true

  private def pin(name: String): Pin = {
    assert(running, "the simulation is over")
    pins.getOrElse(name, throw new RuntimeException(s"Unknown signal: $name"))
  }

  override def poke(name: String, value: BigInt): Unit = {
    val p = pin(name)
    val v = value & p.all
    if (p.words == 1) calls.poke(pokeAt, state, p.id, v.toLong)
    else for (i <- 0 until p.words) calls.pokeWide(pokeWideAt, state, p.id, i, (v >> 64 * i).toLong)
    stale = true
  }

  override def peek(name: String): BigInt = {
    val p = pin(name)
    if (stale) {
      calls.run(updateAt, state)
      stale = false
    }
    val value =
      if (p.width < 64) BigInt(calls.peek(peekAt, state, p.id))
      else {
        val words =
          if (p.words == 1) Seq(calls.peek(peekAt, state, p.id))
          else (0 until p.words).map(calls.peekWide(peekWideAt, state, p.id, _))
        words.foldRight(BigInt(0))((word, above) => above << 64 | BigInt(word) & DirectContext.Word)
      }
    if (p.signed && value.testBit(p.width - 1)) value - p.all - 1 else value
  }

  override def step(n: Int): StepResult = {
    assert(running, "the simulation is over")
    val r = calls.step(stepAt, state, n)
    stale = false
    (r >> 32 & 3).toInt match {
      case 0 => StepOk
      case 3 => throw new RuntimeException("the simulation met a fatal error")
      case s => StepInterrupted(r.toInt, isFailure = s != 1, Nil)
    }
  }

  override def finish(): Unit = {
    assert(running, "the simulation is over")
    running = false
    library.getFunction("finish").invoke(Array[AnyRef](new Pointer(state)))
    library.close()
  }
}

private object DirectContext {
  private val Word = (BigInt(1) << 64) - 1
}

/** A function of a simulation by its address, and the address of the simulation's state. */
private final class DirectCalls private {
  @native def run(function: Long, state: Long): Unit
  @native def step(function: Long, state: Long, cycles: Int): Long
  @native def peek(function: Long, state: Long, id: Int): Long
  @native def poke(function: Long, state: Long, id: Int, value: Long): Unit
  @native def peekWide(function: Long, state: Long, id: Int, word: Int): Long
  @native def pokeWide(function: Long, state: Long, id: Int, word: Int, value: Long): Unit
}

private object DirectCalls {
  lazy val loaded: DirectCalls = {
    val folder  = Files.createTempDirectory("direct-calls")
    val source  = folder.resolve("direct_calls.c")
    val library = folder.resolve("direct_calls.so")
    Using.resource(getClass.getResourceAsStream("/direct_calls.c"))(Files.copy(_, source))
    Seq("g++", "-x", "c", "-O2", "-fPIC", "-shared", "-o", library.toString, source.toString).!!
    System.load(library.toString)
    for (f <- Seq(source, library, folder)) Files.delete(f)
    new DirectCalls
  }
}
