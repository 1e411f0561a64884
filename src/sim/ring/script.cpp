#include "ring/script.h"

#include <filesystem>
#include <fstream>
#include <sstream>

Script::Script(const std::string& path) : path_(path) {
  std::ifstream file(path);
  std::string text;
  if (!path.empty() && (!file || std::filesystem::is_directory(path)))
    throw UserError("cannot read the script '" + path + "'.");
  for (size_t number = 1; std::getline(file, text); ++number) {
    std::istringstream words(text);
    std::string us, word;
    if (!(words >> us) || us[0] == '#') continue;
    Line line{0, number, {}};
    constexpr Time kLatest = kNever / kUs - 1;
    if (us.size() > 12 || us.find_first_not_of("0123456789") != std::string::npos || std::stoll(us) > kLatest)
      bad(number, "'" + us.substr(0, 20) + "' is no time in us up to " + std::to_string(kLatest) + ".");
    line.at = std::stoll(us) * kUs;
    while (words >> word) line.words.push_back(word);
    if (!lines_.empty() && line.at < lines_.back().at) bad(number, "it is before the line in front of it.");
    lines_.push_back(line);
  }
}

void Script::bad(size_t number, const std::string& why) const {
  throw UserError("line " + std::to_string(number) + " of the script '" + path_ + "': " + why);
}
