#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/gateway/text_versions.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/web/api/sources.hpp"

namespace panelgate::gateway {

class Journal;
class Reloader;

/// The text of the file that a reloader reads. One thread.
class ConfigurationText final : public web::TextSource {
  public:
    /// `text`: what runs at the start, read from the reloader's file. The reloader outlives it.
    ConfigurationText(boost::asio::any_io_executor executor, Reloader& reloader, std::string text);
    ConfigurationText(const ConfigurationText&) = delete;
    ConfigurationText& operator=(const ConfigurationText&) = delete;

    /// Keeps versions in the journal's store from now on, behind those of a former program. No text
    /// runs after the journal's end.
    void keep_in(Journal& journal);

    std::string read_only() const override;
    std::function<File()> reader() const override;
    std::function<boost::json::object(const std::string&)> judge() const override;
    std::function<boost::json::object()> schema() const override;
    std::function<Inserted(const std::optional<std::string>&, const std::string&,
                           const boost::json::object&)>
    inserter() const override;
    void write(std::string text, std::string expected, std::string who, Handler handler) override;
    std::vector<web::TextVersion> versions() const override { return versions_.list(); }
    std::optional<std::string> version(std::uint64_t version) const override {
        return versions_.text(version);
    }

  private:
    struct Job;
    void reload(const std::shared_ptr<Job>& job);

    Reloader& reloader_;
    TextVersions versions_;
    std::string built_in_;  ///< the text of a gateway without a file
    boost::asio::any_io_executor executor_;
    std::optional<rt::Worker> worker_;  ///< none until a text is to be written
};

}  // namespace panelgate::gateway
