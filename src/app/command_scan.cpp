#include <iostream>

#include "commands.hpp"
#include "panelgate/scan/report.hpp"
#include "searched.hpp"

namespace panelgate::app {

ExitCode scan(const ScanOptions& options) {
    const Searched searched = search(options);
    if (!searched.result) return searched.code;
    if (options.yaml)
        std::cout << scan::report_yaml(searched.device, *searched.result, searched.profiles_dir);
    else
        std::cout << scan::report_text(options.device, *searched.result, searched.cut_short);
    std::cout << std::flush;
    tell_advice(options, *searched.result);
    return searched.code;
}

}  // namespace panelgate::app
