// Error against cost: every scene of the chart with every method and resolution, as a table. Rows that the table has
// are not made again, so that an interrupted run goes on.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/processor_time.h"
#include "tests/chart/specimen.h"

namespace sectio::chart {
namespace {

struct Measured {
  std::vector<double> answer;
  double cost_s = 0;  // processor's time for a second
  bool too_slow = false;
};

constexpr int kWindows = 40, kAskEvery = 5;
constexpr char kTooSlow[] = "too slow";

// Takes the answers of a run: at rest the mean of the last tenth; in motion what is asked for, between two steps in a
// straight line, as a viewer draws it.
class Answers {
 public:
  Answers(const ChartScene& scene, Specimen& specimen) : scene_(scene), specimen_(specimen) {
    if (moves()) before_ = specimen.answer();
  }
  bool moves() const { return !scene_.asked_at_s.empty(); }

  void look(double t_s, bool at_the_end) {
    if (moves()) return follow(t_s);
    if (at_the_end && ++looks_ % kAskEvery == 1) add(specimen_.answer());
  }
  std::vector<double> taken() {
    for (double& a : answer_) a /= std::max(1, added_);
    return std::move(answer_);
  }

 private:
  void follow(double t_s) {
    const std::vector<double>& at = scene_.asked_at_s;
    if (next_ >= at.size() || t_s + step_s() < at[next_] - 1e-9) return;
    std::vector<double> now = specimen_.answer();
    for (; next_ < at.size() && at[next_] <= t_s + 1e-9; ++next_) {
      const double w = (t_s - at[next_]) / step_s();
      for (std::size_t k = 0; k < now.size(); ++k) answer_.push_back(w * before_[k] + (1 - w) * now[k]);
    }
    before_ = std::move(now);
  }
  double step_s() const { return specimen_.step_s(); }
  void add(const std::vector<double>& now) {
    answer_.resize(now.size(), 0);
    for (std::size_t k = 0; k < now.size(); ++k) answer_[k] += now[k];
    ++added_;
  }

  const ChartScene& scene_;
  Specimen& specimen_;
  std::vector<double> answer_, before_;
  std::size_t next_ = 0;
  int looks_ = 0, added_ = 0;
};

// The cost is the median of windows: what else the machine does in a few of them does not count. A body that
// moves costs more in some windows than in others: there it is the mean.
Measured run(Specimen& specimen, const ChartScene& scene, double limit_s) {
  Measured m;
  Answers answers(scene, specimen);
  const double steps = scene.duration_s / specimen.step_s();
  const int per_window = std::max(1, static_cast<int>(std::lround(steps / kWindows)));
  const int count = answers.moves() ? static_cast<int>(std::ceil(steps / per_window - 1e-9)) : kWindows;
  std::vector<double> windows;
  int n = 0;
  for (int w = 0; w < count; ++w) {
    double took_s = 0;
    for (int i = 0; i < per_window; ++i) {
      const double to_s = ++n * specimen.step_s(), start = processor_time_s();
      specimen.step(to_s);
      took_s += processor_time_s() - start;
      answers.look(to_s, w >= kWindows - kWindows / 10);
    }
    windows.push_back(took_s);
    if (w == 0 && windows.front() * count > limit_s) {
      m.too_slow = true;
      return m;
    }
  }
  m.answer = answers.taken();
  std::sort(windows.begin(), windows.end());
  double sum = 0;
  for (const double w : windows) sum += w;
  m.cost_s = (answers.moves() ? sum / count : windows[windows.size() / 2]) / (per_window * specimen.step_s());
  return m;
}

// One row a measurement; the first five columns name it.
class Table {
 public:
  explicit Table(const std::string& file) : file_(file) {
    std::ifstream in(file);
    std::string line;
    while (std::getline(in, line)) {
      std::istringstream row(line);
      std::string part, key;
      for (int i = 0; i < 5 && std::getline(row, part, ','); ++i) key += part + ",";
      rows_[key] = line;
    }
    if (rows_.empty()) append("scene,model,driver,mesh,across", "ours,elements,cpu_s_per_s,error,answer");
  }
  bool has(const std::string& key) const { return rows_.contains(key + ","); }
  const std::string& row(const std::string& key) const { return rows_.at(key + ","); }
  void append(const std::string& key, const std::string& values) {
    std::ofstream out(file_, std::ios::app);
    out << (rows_[key + ","] = key + "," + values) << "\n";
    if (!out.flush()) throw InputError(file_ + ": can't be written");
  }

 private:
  std::string file_;
  std::map<std::string, std::string> rows_;
};

std::string text_of(const std::vector<double>& answer, int digits) {
  std::string text;
  for (const double a : answer) text += formatted("%s%.*g", text.empty() ? "" : " ", digits, a);
  return text;
}

std::vector<double> reference(const ChartScene& scene, Table& table, bool quick) {
  const std::string key = scene.name + ",reference,,,0";
  if (!table.has(key)) {
    const Reference found = reference_of(scene, quick);
    const std::string values = formatted("0,0,,%.4g,", found.uncertainty);  // no cost: not a point of the chart
    table.append(key, values + text_of(found.answer, 9));
  }
  const std::string& row = table.row(key);
  std::istringstream numbers(row.substr(row.rfind(',') + 1));
  std::vector<double> answer;
  for (double a; numbers >> a;) answer.push_back(a);
  return answer;
}

// False when it was too slow.
bool measure(const ChartScene& scene, const Method& method, int across, const std::vector<double>& expected,
             Table& table, double limit_s) {
  const std::string key =
      scene.name + "," + method.model + "," + method.driver + "," + method.mesh + "," + std::to_string(across);
  if (table.has(key)) return table.row(key).find(kTooSlow) == std::string::npos;
  const auto specimen = method.make(scene, across);
  if (!specimen) return true;
  const Measured m = run(*specimen, scene, limit_s);
  const double error = m.too_slow ? NAN : relative_error(m.answer, expected);
  const std::string values = formatted("%d,%zu,%.4g,%s,", int(method.is_ours), specimen->elements(), m.cost_s,
                                       m.too_slow                           ? kTooSlow
                                       : std::isfinite(error) && error < 10 ? std::to_string(error).c_str()
                                                                            : "failed");
  table.append(key, values + (scene.asked_at_s.empty() ? text_of(m.answer, 5) : std::string()));
  std::printf("%-7s %-24s %-22s %-7s n=%-2d %8zu elements %10.4g s/s  error %s\n", scene.name.c_str(),
              method.model.c_str(), method.driver.c_str(), method.mesh.c_str(), across, specimen->elements(), m.cost_s,
              m.too_slow ? "(too slow)" : std::to_string(error).c_str());
  std::fflush(stdout);
  return !m.too_slow;
}

int run(int argc, char** argv) {
  std::string out = "out/chart.csv", only, model;
  bool quick = false;
  double limit_s = 12;
  Arguments arguments("error_chart", "Measures error and cost of every model on the scenes of the chart.");
  arguments.option("--out", out, "table (CSV); rows that it has are not made again");
  arguments.option("--scene", only, "only this one: bend, twist, indent, open, swing, release, cut, hang");
  arguments.option("--model", model, "only models whose name has this in it");
  arguments.option("--limit-s", limit_s, "a run that would take more of the processor's time is left out");
  arguments.toggle("--quick", quick, "coarse meshes, few drivers");
  if (!arguments.parse(argc, argv)) return 0;
  if (const auto folder = std::filesystem::path(out).parent_path(); !folder.empty())
    std::filesystem::create_directories(folder);
  Table table(out);
  const std::vector<ChartScene> scenes = chart_scenes();
  if (!only.empty() && std::ranges::find(scenes, only, &ChartScene::name) == scenes.end())
    throw InputError("--scene " + only + ": there is none of this name");
  const std::vector<int> resolutions = quick ? std::vector<int>{2, 4} : std::vector<int>{1, 2, 3, 4, 6, 8, 12};
  for (const ChartScene& scene : scenes) {
    if (!only.empty() && scene.name != only) continue;
    std::printf("%s: %s\n", scene.name.c_str(), scene.title.c_str());
    std::fflush(stdout);
    const std::vector<double> expected = reference(scene, table, quick);
    for (const Method& method : methods(quick)) {
      if (method.model.find(model) == std::string::npos) continue;
      for (const int across : resolutions)  // finer ones are slower still
        if (!measure(scene, method, across, expected, table, limit_s)) break;
    }
  }
  return 0;
}

}  // namespace
}  // namespace sectio::chart

int main(int argc, char** argv) {
  return sectio::run_program("error_chart", [&] { return sectio::chart::run(argc, argv); });
}
