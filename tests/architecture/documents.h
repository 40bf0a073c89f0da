// The rules that documents keep, as pure functions of their text: links and paths lead somewhere.
#pragma once

#include <algorithm>
#include <cctype>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace sectio {

struct Found {
  int line = 0;
  std::string text;
};

// Calls use(number, line) for each line of a document in Markdown that is no code.
template <class Use>
void each_line_of_prose(const std::string& markdown, const Use& use) {
  std::istringstream lines(markdown);
  int number = 0;
  bool in_code = false;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.starts_with("```"))
      in_code = !in_code;
    else if (!in_code)
      use(number, line);
  }
}

// The targets of [text](target) and ![picture](target) that are no addresses of the web.
inline std::vector<Found> links(const std::string& markdown) {
  std::vector<Found> found;
  each_line_of_prose(markdown, [&](int number, const std::string& line) {
    for (std::size_t at = line.find("]("); at != std::string::npos; at = line.find("](", at + 2)) {
      const std::string target = line.substr(at + 2, line.find(')', at) - at - 2);
      if (target.find("://") == std::string::npos) found.push_back({number, target});
    }
  });
  return found;
}

// The anchors of a document's headings: lower case, blanks as hyphens, other punctuation left out.
inline std::set<std::string> anchors(const std::string& markdown) {
  std::set<std::string> found;
  each_line_of_prose(markdown, [&](int, const std::string& line) {
    if (!line.starts_with('#')) return;
    std::string anchor;
    for (const char c : line.substr(line.find_first_not_of("# "))) {
      if (c == ' ')
        anchor += '-';
      else if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_')
        anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    found.insert(anchor);
  });
  return found;
}

// Paths from the root of the sources that a text names, code included: "deploy/scenes/two_organs.yaml", and the folder
// alone of "deploy/scenes/*.yaml".
inline std::vector<Found> paths(const std::string& text) {
  static constexpr std::string_view kTops[] = {"common/", "deploy/",     "device_bridge/", "docs/",
                                               "idl/",    "sim_server/", "render_client/", "tests/"};
  const auto in_path = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.' || c == '/' || c == '-';
  };
  std::vector<Found> found;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    for (const std::string_view top : kTops)
      for (std::size_t at = line.find(top); at != std::string::npos; at = line.find(top, at + 1)) {
        if (at > 0 && in_path(line[at - 1]) && !line.substr(0, at).ends_with("./")) continue;
        if (at > 2 && line[at - 3] == '.' && line[at - 2] == '.') continue;  // "../", from somewhere else
        std::size_t end = at;
        while (end < line.size() && in_path(line[end])) ++end;
        std::string path = line.substr(at, end - at);
        if (end < line.size() && (line[end] == '*' || line[end] == '{' || line[end] == '$'))
          path.resize(path.rfind('/') + 1);
        while (path.ends_with('.')) path.pop_back();
        found.push_back({number, path});
      }
  }
  return found;
}

// Works that a comment cites as "Smith et al. 2018" or "Chen, Liu 2024": the last name before the year, and the year.
struct Citation {
  int line = 0;
  std::string name, year;
};
inline std::vector<Citation> citations(const std::string& source) {
  std::vector<Citation> found;
  std::istringstream lines(source);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::size_t comment = line.find("//");
    if (comment == std::string::npos) continue;
    std::istringstream text(line.substr(comment + 2));
    std::string name;
    for (std::string word; text >> word;) {
      while (!word.empty() && (word.front() == '(' || word.front() == '[')) word.erase(0, 1);
      const bool is_year = word.size() >= 4 && (word.starts_with("19") || word.starts_with("20")) &&
                           std::isdigit(static_cast<unsigned char>(word[2])) &&
                           std::isdigit(static_cast<unsigned char>(word[3])) &&
                           (word.size() == 4 || !std::isalnum(static_cast<unsigned char>(word[4])));
      if (is_year && !name.empty()) found.push_back({number, name, word.substr(0, 4)});
      if (word == "et" || word == "al." || word == "al.,") continue;
      while (!word.empty() && std::ispunct(static_cast<unsigned char>(word.back()))) word.pop_back();
      const bool is_name = word.size() > 2 && std::isupper(static_cast<unsigned char>(word[0])) &&
                           std::islower(static_cast<unsigned char>(word.back()));
      name = is_name ? word : "";
    }
  }
  return found;
}

// The place of "//" in a line of code, beyond all quotes; npos if the line has no comment.
inline std::size_t comment_at(std::string_view line) {
  char quote = 0;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const char c = line[i];
    const bool divides_digits = c == '\'' && i > 0 && std::isalnum(static_cast<unsigned char>(line[i - 1]));
    if (quote != 0) {
      if (c == '\\')
        ++i;
      else if (c == quote)
        quote = 0;
    } else if (c == '"' || (c == '\'' && !divides_digits)) {
      quote = c;
    } else if (c == '/' && line[i + 1] == '/') {
      return i;
    }
  }
  return std::string_view::npos;
}

// Whether a sentence begins with a genitive or a free relative clause; a relative clause may follow code, too: "// that
// the server has run".
inline bool is_inverted(std::string_view sentence, bool is_behind_code) {
  static constexpr std::string_view kOpenings[] = {"what",  "of",    "who",     "whose",    "which",  "as",
                                                   "those", "where", "whoever", "whatever", "for who"};
  static constexpr std::string_view kBreaks = " ,:;.";
  std::string text(sentence);
  const auto begins_with = [&](std::string_view words) {
    return text.starts_with(words) &&
           (text.size() == words.size() || kBreaks.find(text[words.size()]) != std::string_view::npos);
  };
  if (is_behind_code && begins_with("that")) return true;
  if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return std::ranges::any_of(kOpenings, begins_with);
}

// Whether a comment begins with a genitive without a noun, as "the server's", or "a wall's, by its depth".
inline bool is_bare_genitive(std::string_view comment) {
  static constexpr std::string_view kArticles[] = {"the ", "The ", "a ", "A ", "an ", "An "};
  for (const std::string_view article : kArticles)
    if (comment.starts_with(article)) {
      comment.remove_prefix(article.size());
      break;
    }
  const auto in_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-'; };
  std::size_t end = 0;
  while (end < comment.size() && in_word(comment[end])) ++end;
  std::string_view rest = comment.substr(end);
  if (end > 0 && rest.starts_with("'s"))
    rest.remove_prefix(2);
  else if (end > 1 && comment[end - 1] == 's' && rest.starts_with("'"))
    rest.remove_prefix(1);
  else
    return false;
  const bool is_end = rest.find_first_not_of(' ') == std::string_view::npos;
  return is_end || std::string_view(",.;:").find(rest.front()) != std::string_view::npos;
}

// Sentences of comments that begin with a genitive or a free relative clause, where a plain sentence begins with its
// subject, and comments that begin with a bare genitive. A comment goes on in the next line if that is a comment as a
// whole and begins in the same column.
inline std::vector<Found> inverted_openings(const std::string& source) {
  static constexpr std::string_view kEnds = ".?!";
  std::vector<Found> found;
  std::istringstream lines(source);
  int number = 0;
  std::size_t column_before = std::string::npos;
  bool has_ended = false;  // the sentence of the line before
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::size_t column = comment_at(line);
    const bool is_behind_code = column != line.find_first_not_of(' ');
    const bool goes_on = !is_behind_code && column == column_before;
    column_before = column;
    if (column == std::string::npos) continue;
    const std::size_t text_at = line.find_first_not_of("/ ", column);
    const std::string_view text = std::string_view(line).substr(std::min(text_at, line.size()));
    const auto judge = [&](std::size_t at, bool is_first) {
      const bool is_capital = at < text.size() && std::isupper(static_cast<unsigned char>(text[at]));
      const bool is_bare = is_first && is_bare_genitive(text);
      if (is_bare || ((is_first || is_capital) && is_inverted(text.substr(at), is_first && is_behind_code)))
        found.push_back({number, std::string(text.substr(at))});
    };
    if (!goes_on || has_ended) judge(0, !goes_on);
    for (std::size_t at = text.find_first_of(kEnds); at < text.size(); at = text.find_first_of(kEnds, at + 1))
      if (at + 2 < text.size() && text[at + 1] == ' ') judge(at + 2, false);
    if (!text.empty()) has_ended = kEnds.find(text.back()) != std::string_view::npos;
  }
  return found;
}

}  // namespace sectio
