#pragma once

#include <string>
#include <variant>
#include <vector>

namespace treeroll::report {

/// A report as headings, text, tables and pictures, to be rendered as HTML and as Markdown.
struct Cell {
  std::string text;
  std::string link;  ///< id of a section or picture of this document; may be empty
};
struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<Cell>> rows;  ///< each as long as columns
};
struct Picture {
  std::string id;  ///< unique in the document
  std::string title;
  std::string caption;
  std::string svg;   ///< the whole file
  std::string file;  ///< where it lies from the report's folder: "figures/a.svg"
};
struct Section {
  std::string id;  ///< unique in the document
  std::string title;
  std::vector<std::variant<std::string, Table, Picture>> blocks;  ///< a string is a paragraph
};
struct Document {
  std::string title;
  std::vector<Section> sections;
};

/// One file that stands alone: style and pictures are inside, no script, nothing is loaded.
std::string to_html(const Document& document);
/// Pictures are links to their files.
std::string to_markdown(const Document& document);

/// Letters, digits, '-' and '_' of a text, others as '-': an id.
std::string to_id(const std::string& text);

}  // namespace treeroll::report
