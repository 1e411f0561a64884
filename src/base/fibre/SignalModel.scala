package flyframe.fibre

import flyframe.params.FibreParams

/** Whether an input hears a signal, noise, or search (FR-10, FR-11, FB-02, FB-03). */
class SignalModel(p: FibreParams) {
  private val longest  = p.samplesIn(2500)
  private val tooShort = p.samplesIn(24) // below 25 ns
  private val window   = 64 * p.sampleMhz
  private val search   = p.samplesIn(180) to p.samplesIn(220)

  private var before      = false
  private var distance    = longest + 1 // samples since the last rising edge
  private var inWindow    = 0           // samples of the window that are over
  private var shortOnes   = 0           // distances in it that are too short
  private var isNoisy     = false
  private var searchEdges = 0

  /** Edges come, and not too many. */
  def signal: Boolean = distance <= longest && !isNoisy

  def hearsSearch: Boolean = searchEdges == SignalModel.SearchEdges

  /** One sample of the input.
    *
    * @return
    *   noise begins
    */
  def sample(light: Boolean): Boolean = {
    distance = longest + 1 min distance + 1
    var begins = false
    if (light && !before) {
      if (distance <= tooShort) shortOnes = SignalModel.MostShort + 1 min shortOnes + 1
      begins = shortOnes > SignalModel.MostShort && !isNoisy
      if (begins) isNoisy = true
      searchEdges = if (search.contains(distance)) SignalModel.SearchEdges min searchEdges + 1 else 0
      distance = 0
    } else if (distance > search.last) searchEdges = 0
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

  /** Short distances in a window that are no noise. */
  val MostShort = 8
}
