package flyframe.report

import java.awt.{BasicStroke, Color, Font, Graphics2D}
import java.awt.geom.{Line2D, Path2D}
import org.jfree.svg.SVGGraphics2D

/** What a pin, or a bus of pins, had in each core cycle.
  *
  * @param bits
  *   1: a level; more: a value, shown in hexadecimal
  * @param driven
  *   whether anybody drives it, cycle by cycle; empty: always
  * @param words
  *   what values are called that are not shown in hexadecimal
  */
final case class Wave(
    name: String,
    bits: Int,
    values: Seq[BigInt],
    driven: Seq[Boolean] = Nil,
    words: Map[BigInt, String] = Map.empty
) {
  def isDriven(cycle: Int): Boolean = driven.isEmpty || driven(cycle)
}

/** A timing picture as SVG text: a row per pin, time to the right. */
object TimingPicture {
  private val Left   = 130
  private val Top    = 40
  private val Row    = 26
  private val Height = 16 // of a wave
  private val Ink    = new Color(0x1f6fb4)
  private val Grid   = new Color(0xdddddd)
  private val Small  = new Font("SansSerif", Font.PLAIN, 11)

  /** @param name
    *   begins the identifiers in the text
    * @param periodNs
    *   a core cycle
    * @param waves
    *   all of the same length
    * @param least
    *   pixels of a cycle
    */
  def apply(name: String, title: String, periodNs: Double, waves: Seq[Wave], least: Double = 2): String = {
    val cycles = waves.map(_.values.size).max
    val step   = (1000.0 / cycles).min(24).max(least)
    val width  = (Left + (cycles * step).toInt + 50).max(7 * title.length)
    val height = Top + waves.size * Row + 12
    val g      = new SVGGraphics2D(width, height)
    g.setDefsKeyPrefix(name)
    g.setPaint(Color.WHITE)
    g.fillRect(0, 0, width, height)
    g.setFont(Small)
    g.setPaint(Color.BLACK)
    g.drawString(title, 6, 14)
    grid(g, cycles, step, periodNs, Top + waves.size * Row)
    for ((wave, i) <- waves.zipWithIndex) {
      val low = Top + (i + 1) * Row - 6
      g.setPaint(Color.BLACK)
      g.drawString(wave.name, 6, low - 3)
      g.setPaint(Ink)
      g.setStroke(new BasicStroke(1.3f))
      if (wave.bits == 1) level(g, wave, step, low) else value(g, wave, step, low)
    }
    g.getSVGElement(name, true, null, null, null) + "\n"
  }

  private def x(cycle: Int, step: Double) = Left + cycle * step

  /** A line each 1, 2, 5, 10 ... times ten core cycles, so that its text has room. */
  private def grid(g: Graphics2D, cycles: Int, step: Double, periodNs: Double, bottom: Int): Unit = {
    val every = Iterator.iterate(1)(_ * 10).flatMap(t => Seq(t, 2 * t, 5 * t)).find(_ * step >= 60).get
    g.setStroke(new BasicStroke(1))
    for (cycle <- 0 to cycles by every) {
      g.setPaint(Grid)
      g.draw(new Line2D.Double(x(cycle, step), Top - 6, x(cycle, step), bottom))
      g.setPaint(Color.DARK_GRAY)
      val ns   = cycle * periodNs
      val text = if (every * periodNs < 5000) f"$ns%.0f ns" else f"${ns / 1000}%.0f us"
      g.drawString(text, x(cycle, step).toFloat, Top - 10f)
    }
  }

  /** Stretches of equal values: where each begins and ends. */
  private def stretches(wave: Wave): Seq[(Int, Int)] = {
    val size = wave.values.size
    val begins = (0 until size).filter(i =>
      i == 0 || wave.values(i) != wave.values(i - 1) || wave.isDriven(i) != wave.isDriven(i - 1)
    )
    begins.zip(begins.drop(1) :+ size)
  }

  private def level(g: Graphics2D, wave: Wave, step: Double, low: Int): Unit = {
    val path = new Path2D.Double
    for ((from, to) <- stretches(wave)) {
      val y =
        if (!wave.isDriven(from)) low - Height / 2.0 else if (wave.values(from) == 0) low else low - Height
      if (from == 0) path.moveTo(x(from, step), y) else path.lineTo(x(from, step), y)
      path.lineTo(x(to, step), y)
    }
    g.draw(path)
  }

  /** A box per value, its text where there is room; a line in the middle where nobody drives. */
  private def value(g: Graphics2D, wave: Wave, step: Double, low: Int): Unit =
    for ((from, to) <- stretches(wave)) {
      val (a, b) = (x(from, step), x(to, step))
      val middle = low - Height / 2.0
      if (!wave.isDriven(from)) g.draw(new Line2D.Double(a, middle, b, middle))
      else {
        val slope = 2.0.min((b - a) / 2)
        val path  = new Path2D.Double
        path.moveTo(a, middle)
        for ((px, py) <- Seq(a + slope -> (low - Height), b - slope -> (low - Height))) path.lineTo(px, py)
        for ((px, py) <- Seq(b -> middle, b - slope -> low.toDouble, a + slope -> low.toDouble))
          path.lineTo(px, py)
        path.closePath()
        g.draw(path)
        val value  = wave.values(from)
        val digits = (wave.bits + 3) / 4
        val text   = wave.words.getOrElse(value, s"%0${digits}x".format(value.bigInteger))
        val wide   = if (wave.words.contains(value)) 5.5 else 7.0 // of a letter
        if (b - a > wide * text.length + 4)
          g.drawString(text, ((a + b) / 2 - (wide / 2 - 0.2) * text.length).toFloat, (middle + 4).toFloat)
      }
    }
}
