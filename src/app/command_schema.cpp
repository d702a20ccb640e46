#include <iostream>

#include "commands.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "schema_json.hpp"

namespace panelgate::app {

ExitCode schema() {
    std::cout << web::json_text(schema_json()) << '\n';
    return kFine;
}

}  // namespace panelgate::app
