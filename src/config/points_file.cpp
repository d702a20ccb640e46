// A station's points from a table: one row a point, one column a key of a point.

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/csv.hpp"
#include "panelgate/points/settings.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using yaml::Mark;
using yaml::Node;

/// Columns of GET /api/v1/points that are no keys: they are passed over.
constexpr std::string_view kShownOnly[] = {"line", "value", "label", "quality", "age_ms", "time"};

bool is_shown_only(std::string_view name) {
    return std::ranges::find(kShownOnly, name) != std::end(kShownOnly);
}

Mark mark_of(const CsvRow& row, std::size_t column) {
    return {row.line, static_cast<int>(column) + 1};
}

void move_to(Node& node, Mark mark) {
    node.mark = mark;
    for (Node& item : node.items) move_to(item, mark);
    for (yaml::Entry& entry : node.entries) {
        entry.mark = mark;
        move_to(entry.value, mark);
    }
}

/// A spreadsheet's 0,5 where only 0.5 is a number.
bool has_decimal_comma(std::string_view cell) {
    const std::size_t comma = cell.find(',');
    return comma != cell.npos && cell.find_first_not_of("+-0123456789,.") == cell.npos &&
           cell.find(',', comma + 1) == cell.npos && cell.size() > 2;
}

/// CSV output protects a text that a spreadsheet would compute, as '=1+1: without that mark.
std::string unprotected(const std::string& cell) {
    const bool is_protected = cell.starts_with('\'') && cell.find_first_of("=+-@", 1) == 1;
    return is_protected ? cell.substr(1) : cell;
}

/// One table while it is read.
class PointsFile {
  public:
    PointsFile(Reader& owner, const std::string& path)
        : problems_(path),
          loading_{owner.loading.files, problems_, owner.loading.config},
          owner_(owner) {
        loading_.line = owner.loading.line;
        loading_.station = owner.loading.station;
        loading_.points = owner.loading.points;
    }

    void read(const std::string& text, std::vector<points::Point>& into) {
        const Csv csv = parse_csv(text);
        if (!csv.fault.empty()) problems_.add({csv.fault_line, 1}, csv.fault);
        if (csv.rows.empty())
            problems_.add({1, 1}, "the first row names the columns, such as name,at,type,unit");
        else if (read_head(csv.rows.front()))
            for (std::size_t i = 1; i < csv.rows.size(); ++i) read_row(csv.rows[i], into);
        owner_.problems().take(problems_);
        owner_.loading.points = loading_.points;
    }

  private:
    /// False if a column is missing, so that no row makes sense.
    bool read_head(const CsvRow& head) {
        const std::vector<std::string_view> keys = point_keys().names();
        for (std::size_t i = 0; i < head.cells.size(); ++i) {
            const std::string& name = head.cells[i];
            const bool is_known = std::ranges::find(keys, name) != keys.end() ||
                                  is_shown_only(name) || name == "station";
            if (!is_known)
                problems_.add(mark_of(head, i), yaml::no_such("column", name, keys));
            else if (std::ranges::find(columns_, name) != columns_.end())
                problems_.add(mark_of(head, i), "there are two columns '" + name + "'");
            columns_.push_back(name);
        }
        bool complete = true;
        for (const std::string_view needed : {"name", "at"}) {
            if (std::ranges::find(columns_, needed) != columns_.end()) continue;
            problems_.add({head.line, 1}, "the column '" + std::string(needed) +
                                              "' is missing; the first row names the columns, "
                                              "separated by ',' or ';'");
            complete = false;
        }
        return complete;
    }

    void read_row(const CsvRow& row, std::vector<points::Point>& into) {
        if (std::ranges::all_of(row.cells, &std::string::empty)) return;
        if (row.cells.size() > columns_.size())
            return problems_.add(mark_of(row, columns_.size()),
                                 "this row has " + std::to_string(row.cells.size()) +
                                     " cells, the first one " + std::to_string(columns_.size()) +
                                     "; a cell with the separator stands in quotes");
        Node node;
        node.kind = Node::Kind::map;
        node.mark = {row.line, 1};
        for (std::size_t i = 0; i < row.cells.size(); ++i) {
            if (columns_[i] == "station" && row.cells[i] != loading_.station->name) return;
            if (row.cells[i].empty() || is_shown_only(columns_[i]) || columns_[i] == "station")
                continue;
            auto value = value_of(columns_[i], unprotected(row.cells[i]), mark_of(row, i));
            if (!value) return;
            node.entries.push_back({columns_[i], mark_of(row, i), std::move(*value)});
        }
        if (into.size() == points::kMaxPoints)
            return problems_.add(node.mark, "a station has at most " +
                                                std::to_string(points::kMaxPoints) + " points");
        Reader reader(loading_, node, "a row");
        if (auto point = load_point(reader, node)) into.push_back(std::move(*point));
    }

    /// Lists and maps stand in a cell as in the configuration: {0: off, 1: on}.
    std::optional<Node> value_of(const std::string& column, const std::string& cell, Mark mark) {
        const bool is_text = column == "name" || column == "at" || column == "unit";
        if (!is_text && has_decimal_comma(cell)) {
            std::string right = cell;
            std::ranges::replace(right, ',', '.');
            problems_.add(mark, column + " has a decimal comma: write " + right + ", not " + cell);
            return std::nullopt;
        }
        Node value;
        if (!is_text && (cell.starts_with('{') || cell.starts_with('['))) {
            yaml::Problems inside(problems_.file());
            value = yaml::parse(cell, inside);
            for (const yaml::Problem& one : inside.list()) problems_.add(mark, one.message);
            move_to(value, mark);
            return inside.empty() ? std::optional(std::move(value)) : std::nullopt;
        }
        value.kind = Node::Kind::scalar;
        value.mark = mark;
        value.scalar = cell == "TRUE" ? "true" : cell == "FALSE" ? "false" : cell;
        return value;
    }

    yaml::Problems problems_;
    Loading loading_;
    Reader& owner_;
    std::vector<std::string> columns_;
};

}  // namespace

bool read_points_file(Reader& in, Station& station) {
    const auto typed = in.text("points_file");
    if (!typed) return false;
    const std::string path = in.loading.path_of(*typed);
    const auto text = in.loading.content_of(path);
    if (!text) {
        in.problem("points_file", "cannot read the points of '" + station.name + "' in " + path);
        return false;
    }
    station.points_file = path;
    PointsFile(in, path).read(*text, station.points);
    return true;
}

}  // namespace panelgate::config
