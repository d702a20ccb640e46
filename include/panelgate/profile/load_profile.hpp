#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::profile {

/// Reads a profile file. `name` is the file's name without ending. Every fault is added to
/// `problems`; nothing is returned then.
std::optional<PanelProfile> load_profile(std::string_view text, std::string name,
                                         yaml::Problems& problems);

/// The known profiles by name. Profiles live as long as the catalogue and do not move.
class Catalogue {
  public:
    /// The profiles compiled into the program. They are valid, a test says so.
    static Catalogue shipped();
    /// Adds or replaces.
    void add(PanelProfile profile);
    const PanelProfile* find(std::string_view name) const;
    const std::map<std::string, PanelProfile, std::less<>>& all() const { return profiles_; }

  private:
    std::map<std::string, PanelProfile, std::less<>> profiles_;
};

}  // namespace panelgate::profile
