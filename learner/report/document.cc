#include "learner/report/document.h"

#include <fmt/format.h>
#include <sodium.h>

#include <algorithm>
#include <cctype>

namespace treeroll::report {
namespace {

constexpr const char* kStyle = R"(
body { font: 15px/1.5 system-ui, sans-serif; color: #111; background: #fff; max-width: 75rem; margin: 0 auto;
  padding: 1rem 1.5rem; }
h1 { font-size: 1.7rem; } h2 { font-size: 1.3rem; margin-top: 2.5rem; border-bottom: 1px solid #999; }
nav ul { columns: 2; padding-left: 1.2rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .85rem; margin: 1rem 0; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid #ccc; padding: .3rem .6rem; text-align: left; vertical-align: top;
  overflow-wrap: break-word; max-width: 26rem; }
th { border-bottom: 2px solid #444; }
tr:nth-child(even) td { background: #f5f5f5; }
figure { margin: 1.5rem 0; } figure img { max-width: 100%; height: auto; }
figcaption { font-size: .9rem; max-width: 50rem; }
a { color: #0645ad; }
@media print {
  body { font-size: 10px; max-width: none; padding: 0; } .scroll { overflow: visible; }
  h2 { break-after: avoid; } tr, figure { break-inside: avoid; } thead { display: table-header-group; }
  a { color: inherit; text-decoration: none; }
}
)";

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

/// A picture as a document of its own within the page: its ids and styles touch no other's.
std::string data_url(const std::string& svg) {
  std::string text(sodium_base64_encoded_len(svg.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(text.data(), text.size(), reinterpret_cast<const unsigned char*>(svg.data()),
                    svg.size(), sodium_base64_VARIANT_ORIGINAL);
  text.pop_back();  // its terminating NUL
  return "data:image/svg+xml;base64," + text;
}

struct Html {
  std::string& out;

  void operator()(const std::string& paragraph) const {
    out += fmt::format("<p>{}</p>\n", escaped(paragraph));
  }
  void operator()(const Table& table) const {
    out += "<div class=\"scroll\"><table>\n<thead><tr>";
    for (const std::string& column : table.columns) {
      out += fmt::format("<th>{}</th>", escaped(column));
    }
    out += "</tr></thead>\n<tbody>\n";
    for (const auto& row : table.rows) {
      out += "<tr>";
      for (const Cell& cell : row) {
        const std::string text = escaped(cell.text);
        out += cell.link.empty()
                   ? fmt::format("<td>{}</td>", text)
                   : fmt::format("<td><a href=\"#{}\">{}</a></td>", escaped(cell.link), text);
      }
      out += "</tr>\n";
    }
    out += "</tbody></table></div>\n";
  }
  void operator()(const Picture& picture) const {
    out += fmt::format(
        "<figure id=\"{}\"><img alt=\"{}\" src=\"{}\">\n<figcaption><b>{}</b> {}</figcaption>"
        "</figure>\n",
        escaped(picture.id), escaped(picture.title), data_url(picture.svg), escaped(picture.title),
        escaped(picture.caption));
  }
};

/// Text that is neither a column's end nor a tag in Markdown.
std::string plain(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\n') {
      result += ' ';
      continue;
    }
    if (c == '|' || c == '*' || c == '_' || c == '<' || c == '`' || c == '[' || c == '\\') {
      result += '\\';
    }
    result += c;
  }
  return result;
}

struct Markdown {
  std::string& out;

  void operator()(const std::string& paragraph) const { out += plain(paragraph) + "\n\n"; }
  void operator()(const Table& table) const {
    out += "|";
    for (const std::string& column : table.columns) out += " " + plain(column) + " |";
    out += "\n|";
    for (std::size_t i = 0; i < table.columns.size(); ++i) out += "---|";
    out += "\n";
    for (const auto& row : table.rows) {
      out += "|";
      for (const Cell& cell : row) out += " " + plain(cell.text) + " |";
      out += "\n";
    }
    out += "\n";
  }
  void operator()(const Picture& picture) const {
    out += fmt::format("![{}]({})\n\n**{}** {}\n\n", plain(picture.title), picture.file,
                       plain(picture.title), plain(picture.caption));
  }
};

}  // namespace

std::string to_id(const std::string& text) {
  std::string id = text;
  std::replace_if(
      id.begin(), id.end(),
      [](unsigned char c) { return c > 127 || (std::isalnum(c) == 0 && c != '_'); }, '-');
  return id;
}

std::string to_html(const Document& document) {
  std::string out = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width\">\n<title>{0}</title>\n<style>{1}</style></head>\n"
      "<body>\n<h1>{0}</h1>\n",
      escaped(document.title), kStyle);
  std::string contents = "<nav><ul>\n";
  for (const Section& section : document.sections) {
    contents += fmt::format("<li><a href=\"#{}\">{}</a></li>\n", escaped(section.id),
                            escaped(section.title));
  }
  out += contents + "</ul></nav>\n";
  for (const Section& section : document.sections) {
    out += fmt::format("<section>\n<h2 id=\"{}\">{}</h2>\n", escaped(section.id),
                       escaped(section.title));
    for (const auto& block : section.blocks) std::visit(Html{out}, block);
    out += "</section>\n";
  }
  return out + "</body></html>\n";
}

std::string to_markdown(const Document& document) {
  std::string out = "# " + plain(document.title) + "\n\n";
  for (const Section& section : document.sections) {
    out += "## " + plain(section.title) + "\n\n";
    for (const auto& block : section.blocks) std::visit(Markdown{out}, block);
  }
  return out;
}

}  // namespace treeroll::report
