#include "panelgate/gateway/text_versions.hpp"

#include <algorithm>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <exception>

#include "panelgate/base/sha256.hpp"

namespace panelgate::gateway {

namespace json = boost::json;

namespace {

/// A line of JSON, then the text.
std::string record_of(const web::TextVersion& version, const std::string& text) {
    return json::serialize(json::object{{"version", version.version},
                                        {"time_us", version.time.time_since_epoch().count()},
                                        {"who", version.who},
                                        {"sha256", version.sha256}}) +
           '\n' + text;
}

}  // namespace

std::optional<TextVersions::Kept> TextVersions::parse(const std::string& record) try {
    const std::size_t head = record.find('\n');
    if (head == record.npos) return std::nullopt;
    const json::value value = json::parse(record.substr(0, head));
    const json::object& about = value.as_object();
    Kept one;
    one.version.version = about.at("version").to_number<std::uint64_t>();
    one.version.time = WallTime(WallTime::duration(about.at("time_us").to_number<std::int64_t>()));
    one.version.who = std::string(about.at("who").as_string());
    one.version.sha256 = std::string(about.at("sha256").as_string());
    one.text = record.substr(head + 1);
    return one;
} catch (const std::exception&) {
    return std::nullopt;
}

void TextVersions::add(const std::string& text, const std::string& who, WallTime now) {
    std::string sha256(text_of(Sha256().of(text)));
    if (!kept_.empty() && kept_.back().version.sha256 == sha256) return;
    const std::uint64_t number = kept_.empty() ? 1 : kept_.back().version.version + 1;
    kept_.push_back({{number, now, who, std::move(sha256)}, text});
    if (kept_.size() > kMost) kept_.erase(kept_.begin());
    if (keep_)
        keep_(std::string(kPrefix) + std::to_string(number % kMost),
              record_of(kept_.back().version, text));
}

void TextVersions::restore(const Records& kept, Keep keep) {
    const std::vector<Kept> own = std::exchange(kept_, {});
    for (const auto& [key, record] : kept)
        if (auto one = parse(record)) kept_.push_back(std::move(*one));
    std::ranges::sort(kept_, {}, [](const Kept& one) { return one.version.version; });
    keep_ = std::move(keep);
    is_restored_ = true;
    for (const Kept& one : own) add(one.text, one.version.who, one.version.time);
}

std::vector<web::TextVersion> TextVersions::list() const {
    std::vector<web::TextVersion> versions;
    if (!is_restored_) return versions;
    for (const Kept& one : kept_) versions.insert(versions.begin(), one.version);
    return versions;
}

std::optional<std::string> TextVersions::text(std::uint64_t version) const {
    for (const Kept& one : kept_)
        if (is_restored_ && one.version.version == version) return one.text;
    return std::nullopt;
}

}  // namespace panelgate::gateway
