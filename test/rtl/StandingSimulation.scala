package flyframe

import chisel3.Module
import chiseltest._
import java.util.concurrent.{SynchronousQueue, TimeUnit}
import scala.util.Try

/** One simulation for all suites that need the same module: it is built once, and used by one at a time.
  *
  * @param make
  *   the module
  * @param suite
  *   whose simulation it is; `title` is unlike all others of it
  */
class StandingSimulation[T <: Module](make: => T, suite: Any, title: String) {
  private val jobs    = new SynchronousQueue[T => Unit]
  private val results = new SynchronousQueue[Try[Unit]]

  @volatile private var ended = Option.empty[Try[Unit]]
  private var bench: T        = _ // of the thread that simulates

  private lazy val started: Thread = {
    val thread = new Thread(() =>
      ended = Some(Try {
        RawTester.test(make, Simulation.annotations(suite, title)) { dut =>
          bench = dut
          while (true) {
            val job = jobs.take()
            results.put(Try(job(dut)))
          }
        }
      })
    )
    thread.setDaemon(true) // ends with the tests
    thread.start()
    thread
  }

  /** Runs `body` with the module as the one before has left it: within a body, too. */
  def apply(body: T => Unit): Unit =
    if (Thread.currentThread eq started) body(bench)
    else
      synchronized {
        while (!jobs.offer(body, 100, TimeUnit.MILLISECONDS)) ended.foreach(_.get)
        results.take().get
      }
}
