package flyframe.report

import java.awt.{BasicStroke, Color, Font, Rectangle}
import org.jfree.chart.axis.{LogarithmicAxis, NumberAxis}
import org.jfree.chart.plot.{CategoryPlot, CombinedRangeXYPlot, PlotOrientation, ValueMarker, XYPlot}
import org.jfree.chart.renderer.xy.XYLineAndShapeRenderer
import org.jfree.chart.renderer.category.{BarRenderer, StandardBarPainter}
import org.jfree.chart.labels.StandardCategoryItemLabelGenerator
import org.jfree.chart.{ChartFactory, JFreeChart}
import org.jfree.data.category.DefaultCategoryDataset
import org.jfree.data.xy.{XYSeries, XYSeriesCollection}
import org.jfree.svg.SVGGraphics2D
import org.jfree.chart.title.LegendTitle
import org.jfree.chart.ui.{RectangleAnchor, RectangleEdge, TextAnchor}

/** The plots of the report, as SVG texts. */
object Plots {
  private val colours = Seq(new Color(0x1f6fb4), new Color(0xd9822b), new Color(0x5b8c5a))
  private val goalInk = new Color(0xa02020)

  /** A bar chart. `series` are named and have a value for each of `rows`; `goals` are lines across. */
  private def bars(
      rows: Seq[String],
      axis: String,
      series: Seq[(String, Seq[Double])],
      lying: Boolean,
      goals: Seq[(String, Double)] = Nil
  ): JFreeChart = {
    val data = new DefaultCategoryDataset
    for ((name, values) <- series; (row, value) <- rows.zip(values)) data.addValue(value, name, row)
    val orientation = if (lying) PlotOrientation.HORIZONTAL else PlotOrientation.VERTICAL
    val chart =
      ChartFactory.createBarChart(null, null, axis, data, orientation, series.size > 1, false, false)
    val plot     = chart.getPlot.asInstanceOf[CategoryPlot]
    val renderer = plot.getRenderer.asInstanceOf[BarRenderer]
    chart.setBackgroundPaint(Color.WHITE)
    plot.setBackgroundPaint(Color.WHITE)
    plot.setRangeGridlinePaint(Color.LIGHT_GRAY)
    plot.setOutlineVisible(false)
    renderer.setBarPainter(new StandardBarPainter)
    renderer.setShadowVisible(false)
    renderer.setDefaultItemLabelsVisible(true)
    renderer.setDefaultItemLabelGenerator(
      new StandardCategoryItemLabelGenerator(
        "{2}",
        java.text.NumberFormat.getIntegerInstance(java.util.Locale.ROOT)
      )
    )
    renderer.setMaximumBarWidth(0.12)
    renderer.setItemMargin(0.03)
    series.indices.foreach(i => renderer.setSeriesPaint(i, colours(i % colours.size)))
    plot.getDomainAxis.setMaximumCategoryLabelWidthRatio(0.5f)
    plot.getRangeAxis.asInstanceOf[NumberAxis].setUpperMargin(0.12)
    goals.foreach { case (text, value) =>
      val marker = new ValueMarker(value, goalInk, new BasicStroke(1.5f))
      marker.setLabel(text)
      marker.setLabelPaint(goalInk)
      marker.setLabelFont(new Font("SansSerif", Font.PLAIN, 12))
      marker.setLabelAnchor(if (lying) RectangleAnchor.BOTTOM_LEFT else RectangleAnchor.TOP_RIGHT)
      marker.setLabelTextAnchor(if (lying) TextAnchor.BOTTOM_RIGHT else TextAnchor.BOTTOM_RIGHT)
      plot.addRangeMarker(marker)
    }
    chart
  }

  /** The same chart gives the same text: identifiers are numbered, not random. */
  private def svg(name: String, chart: JFreeChart, width: Int, height: Int): String = {
    val graphics = new SVGGraphics2D(width, height)
    graphics.setDefsKeyPrefix(name)
    chart.setElementHinting(false)
    chart.draw(graphics, new Rectangle(0, 0, width, height))
    graphics.getSVGElement(name, true, null, null, null) + "\n"
  }

  /** Worst latency at every core clock, with the goals. */
  def latency(r: Results): String = {
    val all = Points.clocks.map(p => r.latency(p.preset))
    val chart = bars(
      Points.clocks.map(p => s"${p.coreClockMhz} MHz"),
      "worst latency, ns",
      Seq("forwarding" -> all.map(_.forwarding.worstNs), "processing" -> all.map(_.processing.worstNs)),
      lying = false,
      Seq(s"goal at ${Points.base.coreClockMhz} MHz" -> Points.latencyNs.toDouble)
    )
    svg("latency", chart, 720, 400)
  }

  /** Logic elements of every variant. */
  def features(r: Results): String = {
    val rows =
      (Points.base.preset -> Points.base.preset) +: Points.variants.map(v => v.title -> v.params.preset)
    val chart = bars(
      rows.map(_._1),
      "logic elements",
      Seq("logic elements" -> rows.map { case (_, name) => r.area(name).logicElements.toDouble }),
      lying = true,
      Seq("goal, cyclone4-min" -> 1500.0)
    )
    svg("features", chart, 720, 460)
  }

  /** Differences in ns over time in s, with a limit; of many values the worst of each of 500 sections. */
  def apart(name: String, series: Seq[(String, Seq[(Double, Double)])], limit: Double): String = {
    val data = new XYSeriesCollection
    for ((title, values) <- series) {
      val line = new XYSeries(title)
      for (section <- values.grouped((values.size / 500).max(1)))
        line.add(section.head._1, section.map(_._2).max.max(1))
      data.addSeries(line)
    }
    val chart = ChartFactory.createXYLineChart(null, "s", "ns", data)
    val plot  = chart.getXYPlot
    plot.setRangeAxis(new LogarithmicAxis("ns"))
    plot.setBackgroundPaint(Color.WHITE)
    plot.setRangeGridlinePaint(Color.LIGHT_GRAY)
    plot.setDomainGridlinesVisible(false)
    plot.addRangeMarker(new ValueMarker(limit, goalInk, new BasicStroke(1.5f)))
    chart.setBackgroundPaint(Color.WHITE)
    val renderer = new XYLineAndShapeRenderer(true, false)
    renderer.setDrawSeriesLineAsPath(true) // one for each series, not one for each piece
    series.indices.foreach(i => renderer.setSeriesPaint(i, colours(i % colours.size)))
    plot.setRenderer(renderer)
    svg(name, chart, 720, 400)
  }

  private val many =
    colours ++ Seq(new Color(0x8e5ea2), new Color(0xa02020))

  private def dataset(series: Seq[(String, Seq[(Double, Double)])]): XYSeriesCollection = {
    val data = new XYSeriesCollection
    for ((title, values) <- series) {
      val line = new XYSeries(title)
      for ((x, y) <- values) line.add(x, y)
      data.addSeries(line)
    }
    data
  }

  private def plain(plot: XYPlot): Unit = {
    plot.setBackgroundPaint(Color.WHITE)
    plot.setRangeGridlinePaint(Color.LIGHT_GRAY)
    plot.setDomainGridlinePaint(Color.LIGHT_GRAY)
  }

  private def renderer(lines: Boolean, shapes: Boolean, count: Int): XYLineAndShapeRenderer = {
    val renderer = new XYLineAndShapeRenderer(lines, shapes)
    for (i <- 0 until count) {
      renderer.setSeriesPaint(i, many(i % many.size))
      renderer.setSeriesStroke(i, new BasicStroke(2f))
    }
    renderer
  }

  /** Lines over several axes side by side, with one axis for all, logarithmic or from 0 on. Every panel has
    * the same series.
    */
  def panels(
      name: String,
      axis: String,
      panels: Seq[(String, Seq[(String, Seq[(Double, Double)])])],
      isLogarithmic: Boolean = true
  ): String = {
    val all = new CombinedRangeXYPlot(if (isLogarithmic) new LogarithmicAxis(axis) else new NumberAxis(axis))
    for ((title, series) <- panels) {
      val domain = new NumberAxis(title)
      domain.setAutoRangeIncludesZero(false)
      val plot = new XYPlot(dataset(series), domain, null, renderer(lines = true, shapes = true, series.size))
      plain(plot)
      all.add(plot)
    }
    val chart = new JFreeChart(null, JFreeChart.DEFAULT_TITLE_FONT, all, false)
    val items = all.getSubplots.get(0).asInstanceOf[XYPlot].getLegendItems
    chart.addLegend(new LegendTitle(() => items))
    chart.getLegend.setPosition(RectangleEdge.BOTTOM)
    chart.setBackgroundPaint(Color.WHITE)
    svg(name, chart, 960, 420)
  }

  /** Curves and measured points over two logarithmic axes; the points have the colours of the curves whose
    * titles theirs begin with.
    */
  def curves(
      name: String,
      x: String,
      y: String,
      curves: Seq[(String, Seq[(Double, Double)])],
      points: Seq[(String, Seq[(Double, Double)])]
  ): String = {
    val plot = new XYPlot(
      dataset(curves),
      new LogarithmicAxis(x),
      new LogarithmicAxis(y),
      renderer(lines = true, shapes = false, curves.size)
    )
    val dots = renderer(lines = false, shapes = true, points.size)
    for (((title, _), i) <- points.zipWithIndex)
      dots.setSeriesPaint(i, many(curves.indexWhere(c => title.startsWith(c._1 + ",")) % many.size))
    plot.setDataset(1, dataset(points))
    plot.setRenderer(1, dots)
    plain(plot)
    val chart = new JFreeChart(null, JFreeChart.DEFAULT_TITLE_FONT, plot, true)
    chart.setBackgroundPaint(Color.WHITE)
    svg(name, chart, 720, 460)
  }

  /** Logic elements of every unit in every preset. */
  def units(r: Results): String = {
    val series = Points.presets.map { p =>
      p.preset -> Points.units.map { case (u, _) =>
        r.units(p.preset).getOrElse(u, Area()).logicElements.toDouble
      }
    }
    svg("units", bars(Points.units.map(_._1), "logic elements", series, lying = true), 720, 720)
  }
}
