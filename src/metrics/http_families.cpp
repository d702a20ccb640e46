#include "http_families.hpp"

#include <string>

namespace panelgate::metrics {

void add_http(Families& out, const Snapshot& snapshot) {
    if (!snapshot.http) return;
    Family requests =
        make_counter("panelgate_http_requests_total", "HTTP requests answered, by status.");
    for (const auto& [code, count] : snapshot.http->requests) {
        requests.counter({{"code", std::to_string(code)}}, count);
    }
    Family failures = make_counter("panelgate_login_failures_total",
                                   "HTTP requests with a token that nobody has.");
    failures.counter({}, snapshot.http->login_failures);
    out.push_back(requests.take());
    out.push_back(failures.take());
}

}  // namespace panelgate::metrics
