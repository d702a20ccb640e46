#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::profile {

/// Reads a profile file. `name` is the file's name without extension. Adds every error to
/// `problems` and then returns nullopt.
std::optional<PanelProfile> load_profile(std::string_view text, std::string name,
                                         yaml::Problems& problems);

/// The known profiles by name. Profiles live as long as the catalogue and do not move.
class Catalogue {
  public:
    /// Returns the profiles compiled into the program. A test checks that they are valid.
    static Catalogue shipped();
    /// Adds or replaces a profile.
    void add(PanelProfile profile);
    const PanelProfile* find(std::string_view name) const;
    const std::map<std::string, PanelProfile, std::less<>>& all() const { return profiles_; }

  private:
    std::map<std::string, PanelProfile, std::less<>> profiles_;
};

}  // namespace panelgate::profile
