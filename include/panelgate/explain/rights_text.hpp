#pragma once

#include <string>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::explain {

/// Who may write where, a row for each way in; "" without rules.
std::string rights_matrix(const config::Config& config);
/// Warns of faces by which a client may write although rules deny the write at other faces.
std::vector<std::string> open_doors(const config::Config& config);

/// Warns of what `check` can know of access and audit, and a start would not refuse: rules that
/// nobody can come by, tokens that have ended, an audit without its folder.
std::vector<std::string> access_doubts(const config::Config& config, WallTime now);

/// What decides on a request that is described in words.
struct Explanation {
    bool allowed = false;
    std::string text;   ///< the rule with file and line, or what else decides
    std::string wrong;  ///< what cannot be understood; then there is nothing else
};
/// `question`: "from=10.0.0.7 role=operator write press/UW102". `file` is named in the text.
Explanation explain(const config::Config& config, const std::string& file,
                    const std::string& question);

}  // namespace panelgate::explain
