#include "panelgate/base/suggest.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <vector>

namespace panelgate {
namespace {

/// Edits (insert, delete, replace, swap of neighbours) that turn a into b.
std::size_t distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before(b.size() + 1);
    std::vector<std::size_t> above(b.size() + 1);
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(above.begin(), above.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replace = above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
            row[j] = std::min({above[j] + 1, row[j - 1] + 1, replace});
            const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
        }
        before = above;
        above = row;
    }
    return above[b.size()];
}

/// Letters and digits, lower case: "Panasonic GT" is panasonic-gt.
std::string plain(std::string_view text) {
    std::string all;
    for (const char c : text) {
        if (c >= 'A' && c <= 'Z') {
            all += static_cast<char>(c - 'A' + 'a');
        } else if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) {
            all += c;
        }
    }
    return all;
}

struct Synonym {
    std::string_view word;
    std::string_view meant;
};
/// What other programs and other trades call it.
constexpr std::array<Synonym, 107> kSynonyms{{{"baudrate", "baud"},
                                              {"speed", "baud"},
                                              {"bitrate", "baud"},
                                              {"bps", "baud"},
                                              {"bytesize", "data_bits"},
                                              {"bits", "data_bits"},
                                              {"n", "none"},
                                              {"no", "none"},
                                              {"e", "even"},
                                              {"o", "odd"},
                                              {"int16", "i16"},
                                              {"s16", "i16"},
                                              {"s32", "i32"},
                                              {"s64", "i64"},
                                              {"int", "i16"},
                                              {"sint16", "i16"},
                                              {"signed", "i16"},
                                              {"uint16", "u16"},
                                              {"uint", "u16"},
                                              {"word", "u16"},
                                              {"unsigned", "u16"},
                                              {"int32", "i32"},
                                              {"dint", "i32"},
                                              {"uint32", "u32"},
                                              {"dword", "u32"},
                                              {"int64", "i64"},
                                              {"uint64", "u64"},
                                              {"float", "f32"},
                                              {"float32", "f32"},
                                              {"real", "f32"},
                                              {"single", "f32"},
                                              {"double", "f64"},
                                              {"float64", "f64"},
                                              {"lreal", "f64"},
                                              {"boolean", "bool"},
                                              {"bit", "bool"},
                                              {"text", "string"},
                                              {"bcd", "bcd16"},
                                              {"warning", "warn"},
                                              {"err", "error"},
                                              {"fatal", "error"},
                                              {"critical", "error"},
                                              {"plain", "text"},
                                              {"ro", "read_only"},
                                              {"rw", "read_write"},
                                              {"admin", "operator"},
                                              {"guest", "viewer"},
                                              {"true", "on"},
                                              {"yes", "on"},
                                              {"false", "off"},
                                              {"no", "off"},
                                              {"off", "none"},
                                              {"swap", "CDAB"},
                                              {"slave", "id"},
                                              {"slaveid", "id"},
                                              {"unit", "id"},
                                              {"unitid", "id"},
                                              {"address", "id"},
                                              {"address", "at"},
                                              {"address", "listen"},
                                              {"register", "at"},
                                              {"register", "read"},
                                              {"bind", "listen"},
                                              {"port", "device"},
                                              {"port", "listen"},
                                              {"tty", "device"},
                                              {"model", "profile"},
                                              {"slaves", "stations"},
                                              {"devices", "stations"},
                                              {"modbus", "modbus_tcp"},
                                              {"host", "listen"},
                                              {"readonly", "access"},
                                              {"size", "limit"},
                                              {"size", "count"},
                                              {"interval", "every"},
                                              {"period", "every"},
                                              {"factor", "scale"},
                                              {"source", "from"},
                                              {"target", "to"},
                                              {"timeout", "response_timeout"},
                                              {"timeoutms", "response_timeout"},
                                              {"sensors", "points"},
                                              {"registers", "points"},
                                              {"tags", "points"},
                                              {"datatype", "type"},
                                              {"unitofmeasurement", "unit"},
                                              {"scaninterval", "every"},
                                              {"pollinterval", "every"},
                                              {"multiplier", "scale"},
                                              {"gain", "scale"},
                                              {"byteorder", "word_order"},
                                              {"endianness", "word_order"},
                                              {"endian", "word_order"},
                                              {"big", "ABCD"},
                                              {"bigendian", "ABCD"},
                                              {"little", "DCBA"},
                                              {"littleendian", "DCBA"},
                                              {"16bit", "u16"},
                                              {"32bit", "u32"},
                                              {"uint8", "u16"},
                                              {"u8", "u16"},
                                              {"byte", "u16"},
                                              {"int8", "i16"},
                                              {"i8", "i16"},
                                              {"s8", "i16"},
                                              {"0", "none"},
                                              {"writable", "access"}}};

/// float32be, uint16le: types with the order of their bytes.
std::string_view without_order(std::string_view typed) {
    const bool ordered = typed.ends_with("be") || typed.ends_with("le");
    return typed.substr(0, typed.size() - (ordered ? 2 : 0));
}

std::string synonym(std::string_view typed, std::span<const std::string_view> candidates) {
    for (const Synonym& synonym : kSynonyms) {
        if (synonym.word != typed) continue;
        const bool known = std::ranges::find(candidates, synonym.meant) != candidates.end();
        if (known) return std::string(synonym.meant);
    }
    return "";
}

}  // namespace

std::string nearest(std::string_view typed, std::span<const std::string_view> candidates) {
    const std::string letters = plain(typed);
    for (const std::string_view candidate : candidates) {
        if (!letters.empty() && plain(candidate) == letters) return std::string(candidate);
    }
    if (std::string meant = synonym(letters, candidates); !meant.empty()) return meant;
    if (std::string meant = synonym(without_order(letters), candidates); !meant.empty())
        return meant;
    std::string_view best;
    std::size_t least = 3;
    for (const std::string_view candidate : candidates) {
        const std::size_t longer = std::max(typed.size(), candidate.size());
        if (longer - std::min(typed.size(), candidate.size()) >= least) continue;
        const std::size_t edits = distance(typed, candidate);
        if (edits < least && edits * 3 <= longer) {
            least = edits;
            best = candidate;
        }
    }
    return std::string(best);
}

}  // namespace panelgate
