package flyframe.relay.model

import flyframe.relay.{LinkBody, LinkFrame, LinkHeader, TransitModel}
import org.scalatest.flatspec.AnyFlatSpec
import java.io.ByteArrayInputStream
import scala.sys.process._
import scala.util.Try

/** That a transit buffer neither overflows nor stalls (FR-48), by induction over all bits: an output, and the
  * input whose good frames it passes on, of any lengths that there are. Only numbers are kept of frames.
  *
  * There is no bound to what waits if an output falls behind for ever: because frames grow, as other hops and
  * another check make for more stuff bits, or because the clock of the input is faster. `behind` is by how
  * many bits that was, since fewer than four waited at last; idle bits of the input are taken off. It is
  * shown that 32 bits do no harm: of the longest frames without a bit between them, at 1,000 ppm, those of
  * some 32,000 bits.
  */
class TransitFormal extends AnyFlatSpec {
  private val budget = 32

  /** Bits of a frame without data and stuff bits, and with all that there may be. */
  private val least   = 1 + LinkHeader.Bits + LinkBody.MaxBits - 64
  private val longest = (1 + LinkHeader.Bits + LinkBody.MaxBits) * 5 / 4 + 1
  private val header  = 1 + LinkHeader.Bits // until the check is there, without stuff bits

  /** @param gap
    *   bits between frames that pass from four waiting ones on (RB-07)
    */
  private def rules(budget: Int, gap: Int) = s"""
    (set-logic ALL)
    (define-fun isLength ((n Int)) Bool (<= $least n $longest))
    (define-fun isHeader ((n Int)) Bool (<= $header n ${header + header / 4}))
    (define-fun end () Int ${LinkFrame.EndBits})
    (define-fun areLengths ((frames Int) (n Int)) Bool
      (<= (* frames (+ $least end)) n (* frames (+ $longest end))))

    ; What there is before a bit, and behind it. A frame comes: bits since its beginning, its length, behind
    ; how many of them it is put into the buffer. So many wait, of so many bits, each with its end. Bits that
    ; are still to be sent, or those since. By how many bits the output is behind.
    ${Seq("", "'")
      .map(s => s"""
    (declare-const |comes$s| Bool) (declare-const |at$s| Int) (declare-const |its$s| Int)
    (declare-const |known$s| Int) (declare-const |count$s| Int) (declare-const |bits$s| Int)
    (declare-const |left$s| Int) (declare-const |quiet$s| Int) (declare-const |behind$s| Int)""")
      .mkString}

    ; Bits that are to be sent, those of the frame that comes and is in the buffer taken off as far as they
    ; are still to come. From four waiting frames on it grows by `behind` only. At most there were three, an
    ; own one had just begun, and the header of the fourth had come.
    (define-fun work ((bits Int) (left Int) (quiet Int)) Int
      (- (+ bits left) (ite (< quiet end) quiet (- end 1))))
    (define-fun coming ((comes Bool) (at Int) (its Int) (known Int)) Int
      (ite comes (ite (< at known) at (- at (+ its end))) 0))
    (define-fun most () Int (+ (* ${LinkFrame.Many - 1} (+ $longest end)) $longest ${header + header / 4} 1))
    (define-fun holds ((comes Bool) (at Int) (its Int) (known Int) (count Int) (bits Int) (left Int)
        (quiet Int) (behind Int)) Bool
      (and (=> comes (and (isLength its) (isHeader known) (<= 1 at (+ its end))))
        (<= 0 count ${TransitModel.Size}) (areLengths count bits)
        (<= 0 left $longest) (<= 0 quiet) (or (= left 0) (= quiet 0))
        (<= 0 behind $budget) (=> (< count ${LinkFrame.Many}) (= behind 0))
        (=> (>= count ${LinkFrame.Many})
          (<= (+ (work bits left quiet) (coming comes at its known)) (+ most behind)))))
    (assert (holds comes at its known count bits left quiet behind))

    ; The input: a frame may begin, is one that is passed on or not, and is longer or shorter at the output.
    ; In a bit that is too long it does nothing.
    (declare-const starts Bool) (declare-const length Int) (declare-const header Int)
    (declare-const isPassed Bool) (declare-const put Int) (declare-const isLong Bool)
    (assert (and (isLength length) (isHeader header) (isLength put)))
    (define-fun begins () Bool (and starts (not isLong) (or (not comes) (= at (+ its end)))))
    (assert (= |comes'| (or begins (and comes (or isLong (not (= at (+ its end))))))))
    (assert (= |at'| (ite begins 1 (ite isLong at (+ at 1)))))
    (assert (= |its'| (ite begins length its)))
    (assert (= |known'| (ite begins header known)))
    (define-fun puts () Bool (and |comes'| (= |at'| |known'|) isPassed (not isLong)))
    (define-fun counted () Int (ite puts (+ count 1) count))
    (define-fun weighed () Int (ite puts (+ bits put end) bits))

    ; The output: an own frame is first or not, and what leaves has a length that one of those can have that
    ; wait. In a bit that is too short it does nothing.
    (declare-const isOwn Bool) (declare-const leaves Int) (declare-const isShort Bool)
    (define-fun free () Bool (and (not isShort) (= left 0)))
    (define-fun since () Int (ite isShort quiet (ite free (+ quiet 1) 0)))
    (define-fun ownFirst () Bool (and isOwn (< counted ${LinkFrame.Many})))
    (define-fun sends () Bool (and free ownFirst (>= since (+ end ${LinkFrame.OwnGap}))))
    (define-fun passes () Bool (and free (not ownFirst) (> counted 0)
      (>= since (+ end (ite (< counted ${LinkFrame.Many}) ${LinkFrame.PassingGap} $gap)))))
    (define-fun rest () Int (- weighed leaves end))
    (assert (isLength leaves))
    (assert (=> passes (areLengths (- counted 1) rest)))
    (assert (= |count'| (ite passes (- counted 1) counted)))
    (assert (= |bits'| (ite passes rest weighed)))
    (assert (= |left'| (ite (or passes sends) leaves (ite (or isShort (= left 0)) left (- left 1)))))
    (assert (= |quiet'| (ite (or passes sends) 0 since)))

    (define-fun lost () Int (+ (ite (and puts (> put |its'|)) (- put |its'|) 0) (ite isShort 1 0)
      (ite (or |comes'| isShort) 0 (- 1))))
    (define-fun sum () Int (ite (< (+ behind lost) 0) 0 (+ behind lost)))
    (assert (<= sum $budget))
    (assert (= |behind'| (ite (< |count'| ${LinkFrame.Many}) 0 sum)))
    """

  private val overflows = s"(and puts (= count ${TransitModel.Size}))"
  private val stalls =
    s"(and free (> counted 0) (>= since (+ end ${LinkFrame.OwnGap})) (not passes) (not sends))"
  private val breaks =
    "(not (holds |comes'| |at'| |its'| |known'| |count'| |bits'| |left'| |quiet'| |behind'|))"

  /** Whether this can be in a bit. */
  private def canBe(what: String, budget: Int = budget, gap: Int = 0): Boolean = {
    val text   = s"${rules(budget, gap)}\n(assert $what)\n(check-sat)\n"
    val answer = (Seq("z3", "-in") #< new ByteArrayInputStream(text.getBytes)).lazyLines_!.mkString(" ").trim
    assert(answer == "sat" || answer == "unsat")
    answer == "sat"
  }
  private def needed(): Unit =
    assume(Try(Seq("z3", "--version").!!).isSuccess, "no z3 on the PATH: run the tests by `make test`")

  "FR-48, RB-07: a transit buffer" should "never overflow, nor stall" in {
    needed()
    assert(!canBe("(not (holds false 0 0 0 0 0 0 0 0))"), "behind reset")
    assert(!canBe(breaks), "what holds before a bit does not behind it")
    assert(!canBe(overflows), "a ninth frame")
    assert(!canBe(stalls), "it waits for more than the gap in front of an own frame")
  }

  "Its proof" should "not hold without RB-07, of a wider gap, or of an output that falls behind for ever" in {
    needed()
    assert(canBe("true"))
    assert(canBe(breaks, gap = LinkFrame.PassingGap))
    assert(canBe(overflows, budget = 2 * budget))
  }
}
