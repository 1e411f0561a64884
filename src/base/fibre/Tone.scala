package flyframe.fibre

import flyframe.params.FibreParams

/** What a port sends (FR-01). */
sealed abstract class Tone {

  /** Its frequency. */
  def khz(p: FibreParams): Int
}

object Tone {
  case object Dominant  extends Tone { def khz(p: FibreParams): Int = p.toneDominantKhz  }
  case object Recessive extends Tone { def khz(p: FibreParams): Int = p.toneRecessiveKhz }
  case object Search    extends Tone { def khz(p: FibreParams): Int = p.toneSearchKhz    }

  /** No light at all (FB-07). */
  case object Dark extends Tone { def khz(p: FibreParams): Int = 1 }

  /** The tone of a level, which is true for recessive. */
  def of(level: Boolean): Tone = if (level) Recessive else Dominant
}
