// flyframe: Chisel generator for on-the-fly industrial-Ethernet RTL.
ThisBuild / scalaVersion := "2.13.15" // the only 2.13 patch with a Chisel 6.7.0 compiler plugin
ThisBuild / version      := "0.1.0"

val chiselVersion = "6.7.0"

lazy val flyframe = (project in file("."))
  .enablePlugins(BuildInfoPlugin)
  .settings(
    name                        := "flyframe",
    Compile / scalaSource       := baseDirectory.value / "src",
    Test / scalaSource          := baseDirectory.value / "test",
    Compile / resourceDirectory := baseDirectory.value / "src" / "resources",
    Compile / mainClass         := Some("flyframe.Main"),
    buildInfoKeys               := Seq[BuildInfoKey](name, version),
    buildInfoPackage            := "flyframe",
    addCompilerPlugin("org.chipsalliance" % "chisel-plugin" % chiselVersion cross CrossVersion.full),
    libraryDependencies ++= Seq(
      "org.chipsalliance"       %% "chisel"                      % chiselVersion,
      "com.github.scopt"        %% "scopt"                       % "4.1.0",
      "com.lihaoyi"             %% "ujson"                       % "3.3.1",
      "org.scala-lang.modules"  %% "scala-xml"                   % "2.2.0",
      "org.jfree"                % "jfreechart"                  % "1.5.5",
      "org.jfree"                % "org.jfree.svg"               % "5.0.6",
      "io.undertow"              % "undertow-core"               % "2.3.18.Final",
      "org.xerial"               % "sqlite-jdbc"                 % "3.47.1.0",
      "org.playframework.anorm" %% "anorm"                       % "2.7.0",
      "org.apache.commons"       % "commons-csv"                 % "1.12.0",
      "org.slf4j"                % "slf4j-nop"                   % "2.0.16",
      "edu.berkeley.cs"         %% "chiseltest"                  % "6.0.0"  % Test,
      "org.scalatest"           %% "scalatest"                   % "3.2.19" % Test,
      "org.pcap4j"               % "pcap4j-core"                 % "1.8.2"  % Test,
      "org.pcap4j"               % "pcap4j-packetfactory-static" % "1.8.2"  % Test,
      "org.seleniumhq.selenium"  % "selenium-chrome-driver"      % "4.27.0" % Test,
      "org.seleniumhq.selenium"  % "selenium-support"            % "4.27.0" % Test
    ),
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
    Test / fork          := true,
    Test / javaOptions ++= Seq("-Xmx6g"),
    Test / testForkedParallel := true,
    Test / testOptions += Tests.Argument(TestFrameworks.ScalaTest, "-oD")
  )
