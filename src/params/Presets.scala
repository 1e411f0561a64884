package flyframe.params

/** A named parameter set. `note` is printed in the list of presets and in the header of all Verilog that
  * reports its identity.
  */
final case class Preset(params: EscParams, text: String, note: Option[String] = None) {
  def name: String = params.preset
}

/** The presets: every named parameter set stands here and nowhere else. */
object Presets {
  private val replayOnly = Some(
    "Reports another maker's identity: for replaying recorded traffic only, never for a product."
  )

  val all: Seq[Preset] = Seq(
    Preset(
      EscParams(preset = "frame-processor", ramKiB = 0),
      "smallest useful: two ports, registers and user RAM, no process data RAM"
    ),
    Preset(
      EscParams(preset = "cyclone4-min", ramKiB = 1),
      "smallest with process data: two ports, 1 KiB RAM, for an EP4CE6"
    ),
    Preset(
      EscParams(
        preset = "et1100",
        ports = 4,
        ramKiB = 8,
        maxSubTelegrams = 128,
        escType = 0x11,
        escBuild = 3,
        reportedFmmus = 8,
        reportedSyncManagers = 8,
        reportedPorts = 0x3b,
        reportedFeatures = 0x00fc
      ),
      "four ports, 8 KiB RAM; no FMMU, SyncManager or distributed clocks yet",
      replayOnly
    )
  )

  def named(name: String): Option[Preset] = all.find(_.name == name)
  def default: Preset                     = all(1)

  /** What must be said about a controller with parameters `p`: the note of the preset whose identity it
    * reports, whatever its own name.
    */
  def note(p: EscParams): Option[String] =
    all.find(preset => preset.note.isDefined && preset.params.escType == p.escType).flatMap(_.note)
}
