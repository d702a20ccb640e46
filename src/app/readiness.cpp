#include "readiness.hpp"

#include <cstddef>
#include <string_view>

#include "panelgate/base/endpoint_text.hpp"
#include "question.hpp"

namespace panelgate::app {
namespace {

constexpr std::size_t kMost = 4096;  // bytes of the answer

bool is_ready(const Said& said) {
    const bool whole = said.text.find("\r\n") != std::string::npos;
    return whole && said.is_http() && (said.status() + ' ').starts_with("200 ");
}

}  // namespace

std::string ask_whether_ready(const std::string& address, std::uint16_t port, Duration patience) {
    const std::string request = "GET /readyz HTTP/1.1\r\nHost: " + endpoint_text(address, port) +
                                "\r\nConnection: close\r\n\r\n";
    const Said said = ask(address, port, request, patience, kMost, is_ready);
    if (is_ready(said)) return {};
    if (said.text.empty()) return said.silence();
    if (!said.is_http()) return "an answer that is no HTTP: " + first_line(said.text);
    const std::string why = first_line(said.body());
    return said.status() + (why.empty() ? "" : ": " + why);
}

}  // namespace panelgate::app
