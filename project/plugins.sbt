addSbtPlugin("org.scalameta" % "sbt-scalafmt"  % "2.6.2")
addSbtPlugin("com.eed3si9n"  % "sbt-buildinfo" % "0.13.2")
