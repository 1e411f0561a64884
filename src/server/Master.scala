package flyframe.server

import java.time.Instant

/** A master as the server knows it.
  *
  * @param life
  *   None: nothing is known but that there is to be one
  * @param heardMs
  *   when its last report came, monotonic; None: none has come since the start of the server
  * @param heard
  *   the same as a time of day
  * @param stored
  *   number of the next event that the log wants; None: the log has not said it yet
  * @param gaps
  *   first and last numbers of events of this life that the log does not have
  * @param fireMs
  *   when the last slave began to burn, monotonic
  * @param lost
  *   frames that were sent in vain lately, also in the life before
  */
final case class Master(
    id: Int,
    life: Option[Life] = None,
    line: LineState = LineState(),
    heardMs: Option[Long] = None,
    heard: Option[Instant] = None,
    stored: Option[Long] = None,
    gaps: Vector[(Long, Long)] = Vector.empty,
    fireMs: Long = 0,
    lost: LostFrames = LostFrames()
)
