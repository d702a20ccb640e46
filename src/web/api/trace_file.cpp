#include "trace_file.hpp"

#include <boost/asio/awaitable.hpp>
#include <cstdint>
#include <utility>

#include "handlers.hpp"
#include "long_answer.hpp"
#include "station_path.hpp"
#include "trace_page.hpp"
#include "trace_pcapng.hpp"

namespace panelgate::web {

HttpResponse pcapng_response(std::string body, const std::string& file_name) {
    HttpResponse response;
    response.content_type = "application/x-pcapng";
    response.body = std::move(body);
    response.headers.emplace_back("Content-Disposition",
                                  "attachment; filename=\"" + file_name + '"');
    return response;
}

/// All that there is when it is asked; what comes meanwhile is the next file's.
Handling get_trace_pcapng(HttpRequest request, const Api* api) {
    constexpr std::size_t kOfATurn = 64;  // entries: some 0.1 ms
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const std::string name = (*line)->name;
    const bus::BusClient* const bus = (*line)->bus;
    TracePcapng file(api->providers.version, name);
    std::string body;
    const std::uint64_t newest = last_of_trace(*bus, 1).next;
    for (std::uint64_t since = 0; since < newest;) {
        const TracePage page = trace_since(*bus, since, kOfATurn);
        if (page.next <= since) break;
        since = page.next;
        file.add(page.part);
        body += file.take();
        boost::asio::awaitable<void> turn = others_turn();
        co_await std::move(turn);
        if (request.caller->has_left()) co_return HttpResponse{};
    }
    body += file.finish();
    co_return pcapng_response(std::move(body), name + ".pcapng");
}

}  // namespace panelgate::web
