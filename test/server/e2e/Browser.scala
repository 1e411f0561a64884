package flyframe.e2e

import java.io.File
import java.nio.file.{Files, Path}
import java.util.NoSuchElementException
import org.openqa.selenium.{By, OutputType, StaleElementReferenceException, WebElement}
import org.openqa.selenium.chrome.{ChromeDriver, ChromeDriverService, ChromeOptions}
import scala.jdk.CollectionConverters._

/** The server's page in headless Chromium. */
final class Browser(page: String) extends AutoCloseable {
  private val driver = {
    val options = new ChromeOptions
    options.setBinary("/usr/bin/chromium")
    options.addArguments(
      "--headless=new",
      "--no-sandbox",
      "--disable-dev-shm-usage",
      "--disable-gpu",
      "--window-size=1200,1000"
    )
    val service = new ChromeDriverService.Builder()
      .usingDriverExecutable(new File("/usr/bin/chromedriver"))
      .usingAnyFreePort()
      .build()
    new ChromeDriver(service, options)
  }
  driver.get(page)

  /** What is there now; None while the page changes under our eyes. */
  private def look[A](body: => A): Option[A] =
    try Some(body)
    catch { case _: StaleElementReferenceException | _: NoSuchElementException => None }
  private def all(css: String): Seq[WebElement] = driver.findElements(By.cssSelector(css)).asScala.toSeq

  /** State of each detector, in the order of the line. */
  def detectors: Seq[String] =
    look(all(".card[data-state]").map(_.getDomAttribute("data-state"))).getOrElse(Nil)
  def labels: Seq[String] = look(all(".card[data-state] .label").map(_.getText)).getOrElse(Nil)

  /** The banner; empty if there is none. */
  def alarm: String = look(driver.findElement(By.id("alarm")).getText).getOrElse("")

  /** The newest entries of the log first. */
  def log: Seq[String] = look(all("#log tr").map(_.getText)).getOrElse(Nil)

  /** Runs JavaScript in the page; what it returns. */
  def script(code: String): AnyRef = driver.executeScript(code)

  /** The banner of a server that cannot write its log; empty if there is none. */
  def broken: String = look(driver.findElement(By.id("broken")).getText).getOrElse("")

  /** Presses a button of the master: acknowledge, silence or reset. */
  def order(name: String): Unit = driver.findElement(By.cssSelector(s".buttons [data-order=$name]")).click()

  def reset(position: Int): Unit = all(".card[data-state] button.reset")(position).click()

  /** The window is that large, pixels. */
  def size(width: Int, height: Int): Unit = {
    driver.executeCdpCommand(
      "Emulation.setDeviceMetricsOverride",
      Map[String, AnyRef](
        "width"             -> Integer.valueOf(width),
        "height"            -> Integer.valueOf(height),
        "deviceScaleFactor" -> Integer.valueOf(1),
        "mobile"            -> java.lang.Boolean.valueOf(width < 600)
      ).asJava
    )
    ()
  }

  def texts(css: String): Seq[String] = look(all(css).map(_.getText)).getOrElse(Nil)
  def attributes(css: String, name: String): Seq[String] =
    look(all(css).map(e => Option(e.getDomAttribute(name)).getOrElse(""))).getOrElse(Nil)

  def screenshot(file: Path): Unit = Files.write(file, driver.getScreenshotAs(OutputType.BYTES))
  def close(): Unit                = driver.quit()
}
