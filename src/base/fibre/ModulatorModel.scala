package flyframe.fibre

import flyframe.params.FibreParams

/** Makes light of a tone (FR-01, FR-02, FB-01). */
class ModulatorModel(p: FibreParams) {
  private val shortest     = p.halfPeriod(p.toneDominantKhz)
  private var tone: Tone   = Tone.Dark
  private var half         = shortest // of the present tone
  private var lasted       = shortest // cycles that the present level has lasted
  private var left         = 0        // cycles until it changes
  private var lit: Boolean = false

  /** The light in the present cycle. */
  def light: Boolean = lit

  /** Ends the present cycle, in which `next` is the tone to be sent. */
  def step(next: Tone): Unit = {
    lasted = shortest min lasted + 1
    if (next != tone) restart(next) else left -= 1
    if (tone == Tone.Dark) lit = lit && lasted < shortest
    else if (left == 0) {
      lit = !lit
      lasted = 0
      left = half
    }
  }

  private def restart(next: Tone): Unit = {
    tone = next
    half = p.halfPeriod(next.khz(p))
    left =
      if (next != Tone.Dominant) half
      else if (lit) shortest - lasted
      else shortest
  }
}
