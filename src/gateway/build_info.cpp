#include "panelgate/gateway/build_info.hpp"

#include <sstream>

#define PANELGATE_TEXT_OF(x) #x
#define PANELGATE_TEXT(x) PANELGATE_TEXT_OF(x)

namespace panelgate::gateway {

const char* build_commit() { return PANELGATE_COMMIT; }

const char* build_compiler() {
#ifdef __clang__
    return "clang " PANELGATE_TEXT(__clang_major__) "." PANELGATE_TEXT(
        __clang_minor__) "." PANELGATE_TEXT(__clang_patchlevel__);
#else
    return "gcc " __VERSION__;
#endif
}

std::map<std::string, std::string> build_libraries() {
    std::map<std::string, std::string> all;
    std::istringstream words(PANELGATE_LIBRARIES);
    for (std::string name, version; words >> name >> version;) all[name] = version;
    return all;
}

std::string build_text() {
    std::string text = "panelgate " PANELGATE_VERSION "\ncommit " + std::string(build_commit()) +
                       ", " + build_compiler() + '\n';
    const char* comma = "";
    for (const auto& [name, version] : build_libraries()) {
        text += comma + name + ' ' + version;
        comma = ", ";
    }
    return text;
}

}  // namespace panelgate::gateway
