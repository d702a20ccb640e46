#pragma once

#include <fstream>
#include <iterator>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate {

/// One entry of tests/data/vectors.yaml: its keys as text, null keys left out.
class Vector {
  public:
    explicit Vector(yaml::Node node) : node_(std::move(node)) {}

    std::optional<std::string> text(std::string_view key) const {
        for (const yaml::Entry& entry : node_.entries) {
            const bool given = entry.value.kind == yaml::Node::Kind::scalar &&
                               (entry.value.quoted || entry.value.scalar != "null");
            if (entry.key == key && given) return entry.value.scalar;
        }
        return std::nullopt;
    }
    std::optional<Bytes> bytes(std::string_view key) const {
        const std::optional<std::string> hex = text(key);
        if (!hex) return std::nullopt;
        return from_hex(*hex).value();
    }
    std::optional<std::size_t> number(std::string_view key) const {
        const std::optional<std::string> digits = text(key);
        if (!digits) return std::nullopt;
        return std::stoul(*digits);
    }
    /// As said for one direction ("request_crc_ok"), else for both, else good: then it was
    /// computed.
    bool crc_ok(std::string_view direction_key) const {
        return text(direction_key).value_or(text("crc_ok").value_or("true")) == "true";
    }
    std::string name() const { return text("name").value(); }
    std::string kind() const { return text("kind").value_or(""); }
    bool is_rtu() const { return text("transport") == "rtu"; }

  private:
    yaml::Node node_;
};
inline void PrintTo(const Vector& vector, std::ostream* out) { *out << vector.name(); }

/// All vectors, in the order of the file; throws when it cannot be read.
inline std::vector<Vector> load_vectors(const std::string& path) {
    std::ifstream in(path);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    yaml::Problems problems(path);
    const yaml::Node document = yaml::parse(text, problems);
    if (text.empty() || !problems.empty()) throw std::runtime_error(path + ": " + problems.text());
    std::vector<Vector> vectors;
    for (const yaml::Entry& entry : document.entries) {
        for (const yaml::Node& node : entry.value.items) vectors.emplace_back(node);
    }
    return vectors;
}

}  // namespace panelgate
