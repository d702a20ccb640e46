#include "output.hpp"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>

#include "commands.hpp"

namespace panelgate::commands {

void print_done(const std::string& text) {
    std::signal(SIGPIPE, SIG_IGN);  // a reader that is gone is told of on stderr as well
    if (std::cout << text << std::flush) return;
    std::cerr << "panelgate: stdout takes nothing; this is done: " << text;
    if (std::freopen("/dev/null", "w", stdout) != nullptr) std::cout.clear();
}

void end_without_output() {
    const int why = errno;
    if (why == EPIPE) std::_Exit(kFine);
    std::cerr << "panelgate: stdout takes nothing: " << std::strerror(why) << '\n';
    std::_Exit(kInternal);
}

}  // namespace panelgate::commands
