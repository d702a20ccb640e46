#include "panelgate/base/csv.hpp"

#include <algorithm>
#include <utility>

namespace panelgate {

namespace {

/// Reads one file from its first byte to its last.
class Scanner {
  public:
    Scanner(std::string_view text, char separator) : text_(text), separator_(separator) {}

    Csv read() {
        while (at_ < text_.size()) read_row();
        return std::move(csv_);
    }

  private:
    void read_row() {
        CsvRow row;
        row.line = line_;
        do {
            row.cells.push_back(text_.substr(at_).starts_with('"') ? quoted() : plain());
        } while (take(separator_));
        const bool ends = at_ == text_.size() || take('\r') || take('\n');
        if (at_ > 0 && text_[at_ - 1] == '\r') take('\n');
        ++line_;
        if (!ends && csv_.fault.empty()) {
            csv_.fault = "behind a closing quote comes a separator or the end of the line";
            csv_.fault_line = row.line;
        }
        if (!ends) at_ = text_.size();
        if (row.cells.size() > 1 || !row.cells[0].empty()) csv_.rows.push_back(std::move(row));
    }

    std::string plain() {
        const std::size_t end =
            std::min(text_.find_first_of(std::string("\r\n") + separator_, at_), text_.size());
        const std::size_t begin = std::exchange(at_, end);
        return std::string(text_.substr(begin, end - begin));
    }

    /// A quote inside is doubled (RFC 4180, 2.7).
    std::string quoted() {
        const int begun = line_;
        std::string cell;
        for (++at_; at_ < text_.size(); ++at_) {
            if (text_[at_] == '"' && text_.substr(at_ + 1, 1) != "\"") {
                ++at_;
                return cell;
            }
            if (text_[at_] == '"') ++at_;
            line_ += text_[at_] == '\n' ? 1 : 0;
            cell += text_[at_];
        }
        csv_.fault = "a quote is not closed";
        csv_.fault_line = begun;
        return cell;
    }

    bool take(char wanted) {
        if (at_ == text_.size() || text_[at_] != wanted) return false;
        ++at_;
        return true;
    }

    std::string_view text_;
    char separator_;
    std::size_t at_ = 0;
    int line_ = 1;
    Csv csv_;
};

}  // namespace

Csv parse_csv(std::string_view text) {
    constexpr std::string_view kMark = "\xEF\xBB\xBF";  // of UTF-8
    if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
    const std::string_view head = text.substr(0, text.find_first_of("\r\n"));
    char separator = ',';
    for (const char other : {';', '\t'})
        if (std::ranges::count(head, other) > std::ranges::count(head, separator))
            separator = other;
    return Scanner(text, separator).read();
}

}  // namespace panelgate
