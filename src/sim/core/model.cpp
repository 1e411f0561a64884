#include "core/model.h"

#include <algorithm>

#include "core/user_error.h"

std::vector<Preset>& builtInPresets() {
  static std::vector<Preset>
      all;  // a function's own, so that adapters may use it before this file's statics exist
  return all;
}

std::string presetNames() {
  std::vector<std::string> names;
  for (const Preset& p : builtInPresets()) names.push_back(p.info.name);
  std::sort(names.begin(), names.end());
  std::string text;
  for (const std::string& n : names) text += (text.empty() ? "" : ", ") + n;
  return text;
}

const Preset& findPreset(const std::string& name) {
  for (const Preset& p : builtInPresets())
    if (p.info.name == name) return p;
  throw UserError("preset '" + name + "' is not built into this program; built in: " + presetNames() + ".");
}
