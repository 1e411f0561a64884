// flyframe: Chisel generator for on-the-fly industrial-Ethernet RTL, in four floors; each may use those below
// it only.
//   base      parameters, registers as data, protocol numbers, golden model, device files; no Chisel
//   rtl       the controllers in Chisel
//   flyframe  command line, emission, documents, report
//   server    log and page of alarm systems and fibre rings
ThisBuild / scalaVersion := "2.13.15" // the only 2.13 patch with a Chisel 6.7.0 compiler plugin
ThisBuild / version      := "0.1.0"

// Two floors are tested at the same time, so that the last long suite of one does not leave a core idle.
Global / concurrentRestrictions := Seq(
  Tags.limitAll(java.lang.Runtime.getRuntime.availableProcessors max 2),
  Tags.limit(Tags.ForkedTestGroup, 2),
  Tags.exclusive(Tags.Clean)
)

val chiselVersion = "6.7.0"

val scalatest  = "org.scalatest"   %% "scalatest"  % "3.2.20"
val chiseltest = "edu.berkeley.cs" %% "chiseltest" % "6.0.0"
val pcap = Seq(
  "org.pcap4j" % "pcap4j-core"                 % "1.8.2",
  "org.pcap4j" % "pcap4j-packetfactory-static" % "1.8.2"
)
val browser = Seq(
  "org.seleniumhq.selenium" % "selenium-chrome-driver" % "4.52.0",
  "org.seleniumhq.selenium" % "selenium-support"       % "4.52.0"
)
val commandLine = "com.github.scopt"  %% "scopt"       % "4.1.0"
val json        = "com.lihaoyi"       %% "ujson"       % "3.3.1"
val csv         = "org.apache.commons" % "commons-csv" % "1.14.1"
val noLogging   = "org.slf4j"          % "slf4j-nop"   % "2.0.20"

/** A floor: sources in src/NAME, tests in test/NAME, everything else as all floors have it. Programs and
  * tests run at the top of the repository.
  */
def floor(name: String): Seq[Setting[_]] = {
  val root = LocalRootProject / baseDirectory
  Seq(
    Compile / scalaSource       := root.value / "src" / name,
    Compile / resourceDirectory := root.value / "src" / name / "resources",
    Test / scalaSource          := root.value / "test" / name,
    Test / resourceDirectory    := root.value / "test" / name / "resources",
    sourcesInBase               := false,
    target                      := root.value / "target" / name,
    run / baseDirectory         := root.value,
    Test / baseDirectory        := root.value,
    scalacOptions ++= Seq(
      "-deprecation",
      "-feature",
      "-unchecked",
      "-language:reflectiveCalls",
      "-Ymacro-annotations",
      "-Xlint:unused"
    ),
    run / fork           := true,
    run / outputStrategy := Some(StdoutOutput),
    run / aggregate      := false,
    runMain / aggregate  := false,
    Test / fork          := true,
    Test / javaOptions ++= Seq("-Xmx6g", "-XX:+UseParallelGC"),
    Test / envVars += "OBJCACHE" -> (root.value / "src" / "sim" / "objcache").toString,
    // Verilated benches run no slower than with Verilator's -Os, and compile in two thirds of the time.
    Test / envVars += "MAKEFLAGS" -> "OPT_FAST=-O1",
    Test / testForkedParallel     := true,
    Test / testOptions += Tests.Argument(TestFrameworks.ScalaTest, "-oD"),
    // Of each suite that has ended: a long run that was interrupted goes on behind them (.ci/run-soak).
    Test / testOptions ++=
      sys.env.get("FLYFRAME_REPORTS").map(Tests.Argument(TestFrameworks.ScalaTest, "-u", _)).toSeq,
    libraryDependencies += scalatest % Test
  )
}

/** Chisel is on the class path. */
val chisel = Seq(
  addCompilerPlugin("org.chipsalliance" % "chisel-plugin" % chiselVersion cross CrossVersion.full),
  libraryDependencies ++= Seq("org.chipsalliance" %% "chisel" % chiselVersion, chiseltest % Test)
)

/** Tests that wait for other programs, or do in Java a thing once: the better of its two compilers costs more
  * than it saves. Not so in long runs, nor in measurements (Test / runMain, `make pictures`).
  */
val simplyCompiled = {
  val simply = "-XX:TieredStopAtLevel=1"
  val isLong = sys.env.get("FLYFRAME_TIER").contains("soak") || sys.env.contains("FLYFRAME_PICTURES")
  Seq(
    Test / javaOptions ++= (if (isLong) Nil else Seq(simply)),
    Test / run / javaOptions := (Test / javaOptions).value.filterNot(_ == simply)
  )
}

lazy val base = (project in file("src/base"))
  .enablePlugins(BuildInfoPlugin)
  .settings(
    floor("base"),
    buildInfoKeys    := Seq[BuildInfoKey](version),
    buildInfoPackage := "flyframe",
    libraryDependencies ++= Seq(commandLine, json, "org.scala-lang.modules" %% "scala-xml" % "2.3.0")
  )

lazy val rtl = (project in file("src/rtl"))
  .dependsOn(base % "compile;test->test")
  .settings(floor("rtl"), chisel, libraryDependencies ++= (csv +: pcap).map(_ % Test))

lazy val server = (project in file("src/server"))
  .dependsOn(base % "compile;test->test", flyframe % "test->test")
  .settings(
    floor("server"),
    simplyCompiled,
    libraryDependencies ++= Seq(
      noLogging,
      "io.undertow"              % "undertow-core"  % "2.3.27.Final",
      "org.xerial"               % "sqlite-jdbc"    % "3.54.1.0",
      "org.playframework.anorm" %% "anorm"          % "2.7.0",
      "org.bouncycastle"         % "bcprov-jdk18on" % "1.87", // Ascon-AEAD128
      csv
    ) ++ browser.map(_ % Test)
  )

lazy val flyframe = (project in file("."))
  .aggregate(base, rtl, LocalProject("server")) // by name, as its tests use this floor
  .dependsOn(base % "compile;test->test", rtl % "compile;test->test")
  .settings(
    floor("flyframe"),
    chisel,
    simplyCompiled,
    Compile / mainClass := Some("flyframe.Main"),
    // The server's tests wait much, so they go first: beside those of the RTL.
    Test / executeTests :=
      (Test / executeTests).dependsOn(LocalProject("server") / Test / executeTests).value,
    libraryDependencies ++= Seq(
      noLogging,
      "org.jfree" % "jfreechart"    % "1.5.6",
      "org.jfree" % "org.jfree.svg" % "5.0.7"
    )
  )
