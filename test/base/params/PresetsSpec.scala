package flyframe.params

import org.scalatest.flatspec.AnyFlatSpec

class PresetsSpec extends AnyFlatSpec {
  "Every preset" should "be buildable" in
    assert(Presets.all.flatMap(p => EscParams.problems(p.params)).isEmpty)

  it should "have a name and a top module of its own" in {
    assert(Presets.all.map(_.name).distinct.size == Presets.all.size)
    assert(Presets.all.map(_.params.topName).distinct.size == Presets.all.size)
    for (p <- Presets.all) assert(Presets.named(p.name).contains(p))
    assert(Presets.named("no-such").isEmpty)
  }

  it should "carry a note if it reports more than it has" in {
    // GEN-07: a master trusts these registers, so only a replay identity may say what is not built.
    for (preset <- Presets.all) {
      val p       = preset.params
      val foreign = p.reportedPorts >= 0
      assert(preset.note.isDefined == foreign, preset.name)
    }
  }

  "The default" should "be the smallest with process data" in {
    assert(Presets.default.name == "cyclone4-min")
    assert(Presets.default.params == EscParams(preset = "cyclone4-min"))
  }

  "A note" should "follow the identity, whatever the name" in {
    val et1100 = Presets.named("et1100").get
    assert(et1100.note.exists(_.contains("another maker's identity")))
    assert(Presets.note(et1100.params.copy(preset = "mine", ports = 2, ramKiB = 1)) == et1100.note)
    assert(Presets.note(et1100.params.copy(escType = EscParams().escType)).isEmpty)
    assert(Presets.note(Presets.default.params.copy(preset = "et1100")).isEmpty)
  }
}
