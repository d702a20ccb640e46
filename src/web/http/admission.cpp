#include "admission.hpp"

#include <unistd.h>
#include <algorithm>
#include <array>
#include <boost/system/error_code.hpp>
#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>

#include "cors.hpp"

namespace panelgate::web {

namespace {

namespace ip = boost::asio::ip;

/// Unmaps IPv4-mapped IPv6 and removes the zone, which hosts are written without.
ip::address plain(const ip::address& address) {
    if (address.is_v4()) return address;
    const ip::address_v6 v6 = address.to_v6();
    if (v6.is_v4_mapped()) return ip::make_address_v4(ip::v4_mapped, v6);
    return ip::address_v6(v6.to_bytes());
}

bool is_port(std::string_view text) {
    return text.size() <= 5 &&
           std::ranges::all_of(text, [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool is_address_v6(const std::string& text) {
    boost::system::error_code error;
    ip::make_address_v6(text, error);
    return !error;
}

/// Accepts the characters of names in practice; RFC 3986 allows more.
bool is_name(std::string_view text) {
    return !text.empty() && std::ranges::all_of(text, [](unsigned char c) {
        return (std::isalnum(c) != 0 && c < 0x80) || c == '-' || c == '.' || c == '_';
    });
}

}  // namespace

std::optional<std::string> host_of_authority(std::string_view authority) {
    const bool bracketed = authority.starts_with('[');
    const std::size_t end = bracketed ? authority.find(']') : authority.find(':');
    if (bracketed && end == authority.npos) return std::nullopt;
    std::string host = to_lower(authority.substr(0, end));
    std::string_view rest = end == authority.npos ? std::string_view() : authority.substr(end);
    if (bracketed) {
        host.erase(0, 1);
        rest.remove_prefix(1);
        if (!is_address_v6(host)) return std::nullopt;
    } else {
        if (host.ends_with('.')) host.pop_back();
        if (!is_name(host)) return std::nullopt;
    }
    if (!rest.empty() && (!rest.starts_with(':') || !is_port(rest.substr(1)))) return std::nullopt;
    return host;
}

std::string port_of_authority(std::string_view authority) {
    const std::size_t host = authority.starts_with('[') ? authority.find(']') : 0;
    const std::size_t colon = authority.find(':', host);
    return colon == authority.npos ? std::string() : std::string(authority.substr(colon + 1));
}

std::vector<std::string> machine_names() {
    std::array<char, 256> buffer{};
    if (::gethostname(buffer.data(), buffer.size() - 1) != 0) return {};
    const std::string name(buffer.data());
    if (name.empty()) return {};
    const std::string first = name.substr(0, name.find('.'));
    return {name, first, first + ".local"};
}

HostNames::HostNames(const Settings& settings, const std::vector<std::string>& machine) {
    names_.insert("localhost");
    for (const std::string& host : settings.hosts) configured_.insert(to_lower(host));
    const auto add = [this](const std::string& host) {
        boost::system::error_code error;
        const ip::address address = ip::make_address(host, error);
        if (error) {
            names_.insert(to_lower(host));
        } else {
            addresses_.insert(plain(address));
        }
    };
    add(settings.address);
    for (const std::string& host : settings.hosts.empty() ? machine : settings.hosts) add(host);
}

bool HostNames::knows(const std::string& host, const ip::address& local) const {
    if (names_.contains(host)) return true;
    boost::system::error_code error;
    const ip::address address = plain(ip::make_address(host, error));
    if (error) return false;
    return address.is_loopback() || address == plain(local) || addresses_.contains(address);
}

namespace {

std::string header(const HttpRequest& request, const char* name) {
    const auto found = request.headers.find(name);
    return found == request.headers.end() ? std::string() : to_lower(found->second);
}

/// True for a page; API and metrics are for programs, and each call may use a line.
bool is_page(const HttpRequest& request) {
    return request.path.empty() || (request.path[0] != "api" && request.path[0] != "metrics");
}

/// A user followed a link. Fetch Metadata: https://www.w3.org/TR/fetch-metadata/
bool follows_link(const HttpRequest& request) {
    return (request.method == "GET" || request.method == "HEAD") &&
           header(request, "sec-fetch-mode") == "navigate" &&
           header(request, "sec-fetch-dest") == "document" && is_page(request);
}

/// True for an origin of ours, such as "http://gateway:8080"; "null" is not. Another port is
/// another site, possibly another user's on this machine, except for configured names, where a
/// proxy may use it.
bool is_ours(std::string_view origin, const HttpRequest& request, const HostNames& names,
             const boost::asio::ip::address& local) {
    const std::size_t scheme = origin.find("://");
    if (scheme == std::string_view::npos) return false;
    const std::string_view authority = origin.substr(scheme + 3);
    const auto host = host_of_authority(authority);
    if (!host || !names.knows(*host, local)) return false;
    return names.is_configured(*host) || request.host.empty() ||
           port_of_authority(authority) == request.port;
}

}  // namespace

std::optional<Problem> check_origin(const HttpRequest& request, const HostNames& names,
                                    const boost::asio::ip::address& local,
                                    const std::vector<std::string>& readers) {
    if (!request.host.empty() && !names.knows(request.host, local)) {
        return problem(421, "this gateway is not called '" + request.host +
                                "'; if it shall be, name it in http: hosts");
    }
    const bool may_read = !listed_origin(request, readers).empty();
    if (may_read && is_reading(request)) return std::nullopt;
    if (header(request, "sec-fetch-site") == "cross-site" && !follows_link(request)) {
        return problem(403, "a page of another site may not ask this gateway", "foreign-page");
    }
    // Browsers send Origin with a change, or a read of the answer by script, even where they send
    // no Fetch Metadata (plain HTTP). A read uses the line too.
    const bool is_foreign = request.method != "OPTIONS" && request.headers.contains("origin") &&
                            !is_ours(header(request, "origin"), request, names, local);
    if (is_foreign && may_read)
        return problem(403, "a page of another site may only read (GET) what this gateway has",
                       "foreign-page");
    if (is_foreign)
        return problem(403,
                       "a page of another site may not ask this gateway; if it is one of yours, "
                       "name its host in http: hosts, and if it shall read, its origin in "
                       "http: cors",
                       "foreign-page");
    return std::nullopt;
}

Duration Logins::hold(TimePoint now, const std::string& address) const {
    const auto known = known_.find(address);
    return known != known_.end() && guesses(now, known->second) ? settings_.hold : Duration::zero();
}

Duration Logins::turn(TimePoint now, const std::string& address) {
    const auto known = known_.find(address);
    if (known == known_.end() || !guesses(now, known->second)) return Duration::zero();
    Failures& failures = known->second;
    const TimePoint mine = std::clamp(failures.free, now, now + settings_.longest_turn);
    failures.free = mine + pause();
    return mine - now;
}

Duration Logins::pause() const { return Duration(1s) / settings_.checks_per_second; }

bool Logins::guesses(TimePoint now, const Failures& failures) const {
    return count_at(now, failures) > settings_.free;
}

void Logins::failed(TimePoint now, const std::string& address) {
    const bool fresh = !known_.contains(address);
    if (fresh && known_.size() >= settings_.addresses) {
        known_.erase(std::ranges::min_element(known_, {},
                                              [](const auto& entry) { return entry.second.last; }));
    }
    Failures& failures = known_[address];
    const unsigned before = fresh ? 0 : count_at(now, failures);
    failures.count = std::min(before + 1, settings_.remembered);
    failures.last = now;
}

void Logins::succeeded(const std::string& address) {
    const auto known = known_.find(address);
    if (known == known_.end()) return;
    known->second.free -= pause();  // not a guess
    if (known->second.count <= 1) {
        known_.erase(known);
    } else {
        --known->second.count;
    }
}

unsigned Logins::count_at(TimePoint now, const Failures& failures) const {
    const auto forgiven = static_cast<unsigned>(
        std::min<Duration::rep>((now - failures.last) / settings_.forgiven_after, failures.count));
    return failures.count - forgiven;
}

Places::Places(const Settings& settings) { apply(settings); }

void Places::apply(const Settings& settings) {
    limit_ = settings.max_connections;
    limit_of_address_ = settings.max_connections_per_address;
    limit_of_streams_ = settings.max_streams_per_address;
    limit_of_throttled_ = settings.max_throttled;
    limit_of_probes_ = settings.probe_places;
}

Places::Arrival Places::admit(const std::string& address) const {
    Arrival arrival;
    if (counted_connections(address) >= limit_of_address_) {
        arrival.leaves = longest(State::idle, false, &address);
        arrival.probes_only = !arrival.leaves;
    } else if (in_state(address, State::wrong) >= limit_of_throttled_) {
        arrival.leaves = longest(State::wrong, false, &address);
    } else if (guests() >= limit_) {
        arrival.leaves = longest(State::wrong, false);
        if (!arrival.leaves) arrival.leaves = longest(State::idle, false);
        if (!arrival.leaves) arrival.leaves = suspect_of_another(address);
        arrival.probes_only = !arrival.leaves;
    }
    return arrival;
}

Places::Arrival Places::arrive(Id id, const std::string& address) {
    Arrival arrival = admit(address);
    if (arrival.probes_only && probes() >= limit_of_probes_)
        arrival.leaves = longest(State::idle, true);
    if (arrival.leaves) leave(*arrival.leaves);
    guests_[id] = {address, arrival.probes_only, State::idle, ++turn_};
    return arrival;
}

void Places::busy(Id id) { set(id, State::busy); }

void Places::suspect(Id id) { set(id, State::suspect); }

void Places::wrong(Id id) { set(id, State::wrong); }

bool Places::stream(Id id) {
    const auto guest = guests_.find(id);
    if (guest == guests_.end()) return true;
    if (in_state(guest->second.address, State::streaming) >= limit_of_streams_) return false;
    set(id, State::streaming);
    return true;
}

void Places::set(Id id, State state) {
    const auto guest = guests_.find(id);
    if (guest != guests_.end() && !guest->second.probes_only) guest->second.state = state;
}

void Places::idle(Id id) {
    const auto guest = guests_.find(id);
    if (guest == guests_.end() || guest->second.state == State::idle) return;
    guest->second.state = State::idle;
    guest->second.since = ++turn_;
}

void Places::leave(Id id) { guests_.erase(id); }

bool Places::is_throttled(Id id) const {
    const auto guest = guests_.find(id);
    return guest != guests_.end() && guest->second.state == State::wrong;
}

std::size_t Places::probes() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(guests_, [](const auto& entry) { return entry.second.probes_only; }));
}

std::size_t Places::guests() const { return guests_.size() - probes(); }

std::size_t Places::counted_connections(const std::string& address) const {
    return static_cast<std::size_t>(std::ranges::count_if(guests_, [&](const auto& entry) {
        const Guest& guest = entry.second;
        const bool counts_against_limit =
            guest.state != State::wrong && guest.state != State::streaming;
        return !guest.probes_only && counts_against_limit && guest.address == address;
    }));
}

std::size_t Places::in_state(const std::string& address, State state) const {
    return static_cast<std::size_t>(std::ranges::count_if(guests_, [&](const auto& entry) {
        return entry.second.state == state && entry.second.address == address;
    }));
}

std::optional<Places::Id> Places::longest(State state, bool probes_only,
                                          const std::string* address) const {
    std::optional<Id> found;
    std::uint64_t since = 0;
    for (const auto& [id, guest] : guests_) {
        if (guest.state != state || guest.probes_only != probes_only) continue;
        if (address && guest.address != *address) continue;
        if (found && guest.since > since) continue;
        found = id;
        since = guest.since;
    }
    return found;
}

std::optional<Places::Id> Places::suspect_of_another(const std::string& address) const {
    for (const auto& [id, guest] : guests_) {
        if (guest.state == State::suspect && guest.address != address) return id;
    }
    return std::nullopt;
}

Duration RateLimiter::take(TimePoint now, const std::string& address, std::size_t bytes) {
    if (used_until_.size() >= settings_.addresses)
        std::erase_if(used_until_, [&](const auto& entry) { return entry.second <= now; });
    TimePoint& used = used_until_[address];
    const Duration cost = settings_.request + Duration(1s) * bytes / settings_.bytes_per_second;
    used = std::min(std::max(used, now) + cost, now + settings_.burst + settings_.longest_wait);
    return std::max(used - now - settings_.burst, Duration::zero());
}

}  // namespace panelgate::web
