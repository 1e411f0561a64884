package flyframe.fibre

import flyframe.params.FibreParams

/** Whether an input hears a signal, noise, or search (FR-10, FR-11, FB-02, FB-03, FB-12). */
class SignalModel(p: FibreParams) {
  private val tooShort = p.samplesIn(24) // below 25 ns
  private val count    = p.samplesPerCycle
  private val window   = 64 * p.sampleMhz
  private val search   = p.searchSamples
  private val nearest  = search.head
  private val farthest = search.last

  private var before      = false
  private var distance    = farthest + 1           // samples since the last rising edge
  private var silence     = SignalModel.MostSilent // and so many times 16 more
  private var inWindow    = 0                      // samples of the window that are over
  private var shortOnes   = 0                      // distances in it that are too short
  private var isNoisy     = false
  private var searchEdges = 0

  /** Edges come, and not too many. */
  def signal: Boolean = silence < SignalModel.MostSilent && !isNoisy

  def hearsSearch: Boolean = searchEdges == SignalModel.SearchEdges

  /** Ends a core cycle.
    *
    * @param lights
    *   the samples of it, the first one in bit 0
    * @param slow
    *   another 16 samples are over
    * @return
    *   noise begins
    */
  def step(lights: Int, slow: Boolean): Boolean = {
    val isFar  = distance > farthest
    var begins = false
    var i      = 0
    while (i < count) {
      begins |= sample((lights >> i & 1) == 1)
      i += 1
    }
    if (distance <= farthest) silence = 0
    else if (isFar && slow) silence = SignalModel.MostSilent min silence + 1
    begins
  }

  /** One sample of the input.
    *
    * @return
    *   noise begins
    */
  private def sample(light: Boolean): Boolean = {
    if (distance <= farthest) distance += 1
    var begins = false
    if (light && !before) {
      if (distance <= tooShort) shortOnes = SignalModel.MostShort + 1 min shortOnes + 1
      begins = shortOnes > SignalModel.MostShort && !isNoisy
      if (begins) isNoisy = true
      searchEdges =
        if (distance >= nearest && distance <= farthest) SignalModel.SearchEdges min searchEdges + 1 else 0
      distance = 0
    } else if (distance > farthest) searchEdges = 0
    before = light
    inWindow += 1
    if (inWindow == window) {
      isNoisy = shortOnes > SignalModel.MostShort
      inWindow = 0
      shortOnes = 0
    }
    begins
  }
}

object SignalModel {

  /** Distances of search in a row until it is heard. */
  val SearchEdges = 16

  /** Times 16 samples, after which there is no signal. */
  val MostSilent = 16

  /** Short distances in a window that are no noise. */
  val MostShort = 8
}
