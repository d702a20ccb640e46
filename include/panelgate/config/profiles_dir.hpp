#pragma once

#include <string>
#include <vector>

#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// Adds the profiles of a directory to a catalogue, or replaces its own by them. What is wrong
/// inside a file goes to `problems`, with that file's name; returns a text for the directory, or
/// for each file, that cannot be read.
std::vector<std::string> add_profiles(const std::string& dir, const Files& files,
                                      profile::Catalogue& catalogue, yaml::Problems& problems);

}  // namespace panelgate::config
