#include "panelgate/gateway/text_versions.hpp"

#include <algorithm>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <chrono>
#include <functional>
#include <utility>

#include "panelgate/base/sha256.hpp"

namespace panelgate::gateway {

std::map<std::string, std::string> MemoryKeeper::kept(const std::string& prefix) const {
    std::map<std::string, std::string> found;
    for (auto at = kept_.lower_bound(prefix); at != kept_.end() && at->first.starts_with(prefix);
         ++at)
        found.insert(*at);
    return found;
}

namespace {

const std::string kPlace = "configuration/";  ///< keys: one of kMost places each

/// A line of JSON, then the text.
std::string record_of(const web::TextVersion& version, const std::string& text) {
    const auto time =
        std::chrono::duration_cast<std::chrono::microseconds>(version.time.time_since_epoch());
    return boost::json::serialize(boost::json::object{{"version", version.version},
                                                      {"time_us", time.count()},
                                                      {"who", version.who},
                                                      {"sha256", version.sha256}}) +
           '\n' + text;
}

}  // namespace

std::vector<TextVersions::Kept> TextVersions::kept() const {
    std::vector<Kept> all;
    for (auto& [key, record] : keeper_.kept(kPlace)) {
        const std::size_t head = record.find('\n');
        boost::system::error_code damaged;
        const boost::json::value value = boost::json::parse(record.substr(0, head), damaged);
        if (damaged || head == record.npos) continue;
        const boost::json::object& about = value.as_object();
        Kept one;
        one.version.version = about.at("version").to_number<std::uint64_t>();
        one.version.time =
            WallTime(std::chrono::microseconds(about.at("time_us").to_number<std::int64_t>()));
        one.version.who = std::string(about.at("who").as_string());
        one.version.sha256 = std::string(about.at("sha256").as_string());
        one.text = record.substr(head + 1);
        all.push_back(std::move(one));
    }
    std::ranges::sort(all, std::greater(), [](const Kept& one) { return one.version.version; });
    return all;
}

TextVersions::TextVersions(TextKeeper& keeper) : keeper_(keeper) {
    if (const std::vector<Kept> all = kept(); !all.empty()) last_ = all.front().version;
}

void TextVersions::add(const std::string& text, const std::string& who, WallTime now) {
    std::string sha256(text_of(Sha256().of(text)));
    if (sha256 == last_.sha256) return;
    last_ = {last_.version + 1, now, who, std::move(sha256)};
    keeper_.keep(kPlace + std::to_string(last_.version % kMost), record_of(last_, text));
}

std::vector<web::TextVersion> TextVersions::list() const {
    std::vector<web::TextVersion> versions;
    for (Kept& one : kept()) versions.push_back(std::move(one.version));
    return versions;
}

std::optional<std::string> TextVersions::text(std::uint64_t version) const {
    for (Kept& one : kept())
        if (one.version.version == version) return std::move(one.text);
    return std::nullopt;
}

}  // namespace panelgate::gateway
