package flyframe.frame

import chisel3._
import flyframe.mii.NibbleStream

/** A unit that stands on the wire path, too: behind the frame processor, in front of the other ports. */
trait Stage {

  /** What leaves the stage.
    *
    * @param step
    *   once per nibble slot
    * @param in
    *   what leaves the frame processor
    * @param position
    *   where that lies in its frame
    */
  def pass(step: Bool, in: NibbleStream, position: FramePosition): NibbleStream
}
