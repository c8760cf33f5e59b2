#include "spillikin/sort/weights.h"

#include <CGAL/Gmpq.h>
#include <CGAL/QP_functions.h>
#include <CGAL/QP_models.h>
#include <glpk.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <span>
#include <utility>

#include "spillikin/sort/regularity.h"

namespace spillikin::sort {
namespace {

constexpr double overshoot = 1.5;          // of a step across a violated inequality; between 0 and 2
constexpr double margin_of_median = 0.01;  // of the median slack of convex creases of squared lengths: pushed to
constexpr double flat = 1e-12;             // slack of no account there: mere rounding
constexpr double held_margins = 4.0;       // of slack: what relaxation moves, or has just moved
constexpr std::size_t most_sets = 8;       // of violated faces are looked at for a contradiction
constexpr int most_pivots = 5'000;
constexpr double least_multiplier = 1e-9;
constexpr std::size_t most_held = 8000;     // faces of such a set: what GLPK takes a second for
constexpr std::size_t most_confirmed = 60;  // faces: what rationals take a second for

// The height of the fifth vertex over the linear function of the others, up to a positive factor.
struct Row {
  std::array<mesh::Id, 5> vertex;
  std::array<double, 5> factor;
  double value(const std::vector<double>& heights) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < 5; ++k)
      sum += factor[k] * heights[vertex[k]];
    return sum;
  }
};

template <class T>
T volume(const std::array<T, 3>& a, const std::array<T, 3>& b, const std::array<T, 3>& c, const std::array<T, 3>& d) {
  std::array<T, 3> u, v, w;
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = b[k] - a[k];
    v[k] = c[k] - a[k];
    w[k] = d[k] - a[k];
  }
  return u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
}

template <class T>
std::array<T, 5> factors(const std::array<std::array<T, 3>, 5>& p) {
  return {-volume(p[4], p[1], p[2], p[3]), -volume(p[0], p[4], p[2], p[3]), -volume(p[0], p[1], p[4], p[3]),
          -volume(p[0], p[1], p[2], p[4]), volume(p[0], p[1], p[2], p[3])};
}

class Search {
 public:
  Search(const mesh::Mesh& mesh, std::size_t most_steps) : mesh_(mesh), most_steps_(most_steps) {}

  Weights operator()(bool prove) {
    makeRows();
    Weights weights;
    if (relax()) {
      for (std::size_t v = 0; v < heights_.size(); ++v)
        heights_[v] = heights_[place_[v]];
      weights.verdict = Weights::Verdict::exist;
      weights.heights = std::move(heights_);
      return weights;
    }
    if (!prove) return weights;
    for (const auto& rows : quarrels()) {
      if (!contradiction(rows, weights.contradiction)) continue;
      weights.verdict = Weights::Verdict::none;
      return weights;
    }
    return weights;
  }

 private:
  std::array<mesh::Id, 5> vertices(mesh::Id face) const {
    const Hinge h = hinge(mesh_, face);
    const mesh::Id* v = mesh_.cell_vertex.data() + 4 * std::size_t{h.cell};
    return {place_[v[0]], place_[v[1]], place_[v[2]], place_[v[3]], place_[h.apex]};
  }

  void makeRows() {
    const std::size_t count = mesh_.points.size();
    place_.resize(count);
    Vec3 middle(0.0);
    for (std::size_t v = 0; v < count; ++v) {
      place_[v] = v > 0 && mesh_.points[v] == mesh_.points[v - 1] ? place_[v - 1] : static_cast<mesh::Id>(v);
      middle += mesh_.points[v] / static_cast<double>(count);
    }
    double size = 0.0;
    for (const Vec3& p : mesh_.points) {
      for (int k = 0; k < 3; ++k)
        size = std::max(size, std::abs(p[k] - middle[k]));
    }
    std::vector<std::array<double, 3>> at(count);
    heights_.resize(count);
    for (std::size_t v = 0; v < count; ++v) {
      const Vec3 p = (mesh_.points[v] - middle) / size;
      at[v] = {p.x, p.y, p.z};
      heights_[v] = p.x * p.x + p.y * p.y + p.z * p.z;
    }
    std::vector<double> slack;
    for (mesh::Id f = 0; f < mesh_.triangle_count(); ++f) {
      if (mesh_.triangle_cells[f][1] == mesh::none) continue;
      Row row{vertices(f), {}};
      std::array<std::array<double, 3>, 5> p;
      for (std::size_t k = 0; k < 5; ++k)
        p[k] = at[row.vertex[k]];
      row.factor = factors(p);
      double length = 0.0;
      for (const double x : row.factor)
        length += x * x;
      for (double& x : row.factor)
        x /= std::sqrt(length);
      rows_.push_back(row);
      face_.push_back(f);
      const double value = row.value(heights_);
      if (value > flat) slack.push_back(value);
    }
    if (slack.empty()) slack.push_back(1.0);
    std::nth_element(slack.begin(), slack.begin() + static_cast<std::ptrdiff_t>(slack.size() / 2), slack.end());
    margin_ = margin_of_median * slack[slack.size() / 2];
  }

  // Across the inequality, if it is violated.
  bool push(const Row& row) {
    const double value = row.value(heights_);
    if (value >= margin_) return false;
    for (std::size_t k = 0; k < 5; ++k)
      heights_[row.vertex[k]] += overshoot * (margin_ - value) * row.factor[k];
    return true;
  }

  // True when all creases are convex.
  bool relax() {
    double worst_before = -HUGE_VAL;
    for (std::size_t step = 0, next_stop = 512, next_look = 0, sweep = 0; step <= most_steps_;
         ++sweep, step += rows_.size()) {
      double worst = HUGE_VAL;
      for (const Row& row : rows_) {
        worst = std::min(worst, row.value(heights_));
        push(row);
      }
      // Exactly, and seldom: creases that are all but flat take exact arithmetic.
      if (worst > 0.0 && sweep >= next_look) {
        const Regularity found = regularity(mesh_, heights_, true);
        if (found.irregular == 0 && found.tied == 0) return true;
        next_look = 2 * sweep + 1;
      }
      if (sweep == next_stop) {  // twice the sweeps made no difference
        if (worst < 0.0 && worst < 0.99 * worst_before) return false;
        worst_before = worst;
        next_stop *= 2;
      }
    }
    return false;
  }

  // Where relaxation no longer gets on, what a sweep adds to the heights cancels out: the rows that it moves are those
  // of contradictions. Sets of them that share vertices, the worst first.
  std::vector<std::vector<std::size_t>> quarrels() {
    std::vector<mesh::Id> parent(mesh_.points.size());
    std::iota(parent.begin(), parent.end(), 0U);
    const auto root = [&](mesh::Id v) {
      while (parent[v] != v)
        v = parent[v] = parent[parent[v]];
      return v;
    };
    std::vector<std::size_t> held;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (rows_[i].value(heights_) > held_margins * margin_) continue;
      held.push_back(i);
      for (const mesh::Id v : rows_[i].vertex)
        parent[root(v)] = root(rows_[i].vertex[0]);
    }
    std::map<mesh::Id, std::vector<std::size_t>> sets;
    std::map<mesh::Id, double> worst;
    for (const std::size_t i : held) {
      const mesh::Id r = root(rows_[i].vertex[0]);
      sets[r].push_back(i);
      worst[r] = std::min(worst[r], rows_[i].value(heights_));
    }
    std::vector<std::pair<double, mesh::Id>> order;
    order.reserve(worst.size());
    for (const auto& [r, value] : worst)
      order.emplace_back(value, r);
    std::sort(order.begin(), order.end());
    std::vector<std::vector<std::size_t>> result;
    for (std::size_t i = 0; i < std::min(order.size(), most_sets); ++i)
      result.push_back(std::move(sets[order[i].second]));
    return result;
  }

  // Multipliers that sum to one and add the rows to nothing, if GLPK finds some and they are confirmed.
  bool contradiction(const std::vector<std::size_t>& rows, std::vector<mesh::Id>& faces) const {
    std::vector<std::size_t> used;
    return rows.size() <= most_held && multipliers(rows, used) && used.size() <= most_confirmed &&
           confirmed(used, faces);
  }

  bool multipliers(const std::vector<std::size_t>& rows, std::vector<std::size_t>& used) const {
    glp_term_out(GLP_OFF);
    const std::unique_ptr<glp_prob, void (*)(glp_prob*)> problem(glp_create_prob(), glp_delete_prob);
    std::map<mesh::Id, int> equation;
    std::vector<int> i{0}, j{0};
    std::vector<double> a{0.0};
    for (std::size_t column = 0; column < rows.size(); ++column) {
      const Row& row = rows_[rows[column]];
      for (std::size_t k = 0; k < 5; ++k) {
        i.push_back(equation.emplace(row.vertex[k], static_cast<int>(equation.size()) + 2).first->second);
        j.push_back(static_cast<int>(column) + 1);
        a.push_back(row.factor[k]);
      }
      i.push_back(1);
      j.push_back(static_cast<int>(column) + 1);
      a.push_back(1.0);
    }
    glp_add_rows(problem.get(), static_cast<int>(equation.size()) + 1);
    glp_add_cols(problem.get(), static_cast<int>(rows.size()));
    glp_set_row_bnds(problem.get(), 1, GLP_FX, 1.0, 1.0);
    for (int r = 2; r <= static_cast<int>(equation.size()) + 1; ++r)
      glp_set_row_bnds(problem.get(), r, GLP_FX, 0.0, 0.0);
    for (int c = 1; c <= static_cast<int>(rows.size()); ++c)
      glp_set_col_bnds(problem.get(), c, GLP_LO, 0.0, 0.0);
    glp_load_matrix(problem.get(), static_cast<int>(a.size()) - 1, i.data(), j.data(), a.data());
    glp_smcp options;
    glp_init_smcp(&options);
    options.msg_lev = GLP_MSG_OFF;
    options.it_lim = most_pivots;
    options.tol_bnd = options.tol_dj = 1e-10;
    if (glp_simplex(problem.get(), &options) != 0 || glp_get_status(problem.get()) != GLP_OPT) return false;
    for (std::size_t column = 0; column < rows.size(); ++column) {
      if (glp_get_col_prim(problem.get(), static_cast<int>(column) + 1) > least_multiplier)
        used.push_back(rows[column]);
    }
    return true;
  }

  // The same again for those rows alone, in rationals.
  bool confirmed(const std::vector<std::size_t>& rows, std::vector<mesh::Id>& faces) const {
    using Number = CGAL::Gmpq;
    CGAL::Quadratic_program<Number> program(CGAL::EQUAL, true, Number(0), false, Number(0));
    std::map<mesh::Id, int> equation;
    for (std::size_t column = 0; column < rows.size(); ++column) {
      const std::array<mesh::Id, 5> v = vertices(face_[rows[column]]);
      std::array<std::array<Number, 3>, 5> p;
      for (std::size_t k = 0; k < 5; ++k) {
        const Vec3& point = mesh_.points[v[k]];
        p[k] = {Number(point.x), Number(point.y), Number(point.z)};
      }
      const auto f = factors(p);
      for (std::size_t k = 0; k < 5; ++k) {
        const int r = equation.emplace(v[k], static_cast<int>(equation.size()) + 1).first->second;
        program.set_a(static_cast<int>(column), r, f[k] / f[4]);
      }
      program.set_a(static_cast<int>(column), 0, Number(1));
    }
    program.set_b(0, Number(1));
    const auto solution = CGAL::solve_nonnegative_linear_program(program, Number());
    if (solution.is_infeasible()) return false;
    faces.clear();
    auto value = solution.variable_values_begin();
    for (const std::size_t row : rows) {
      if (CGAL::to_double(*value++) > 0.0) faces.push_back(face_[row]);
    }
    return true;
  }

  const mesh::Mesh& mesh_;
  std::size_t most_steps_;
  std::vector<mesh::Id> place_;  // by vertex: the first at the same place
  std::vector<double> heights_;
  std::vector<Row> rows_;
  std::vector<mesh::Id> face_;  // of each row, ascending
  double margin_ = 0.0;
};

}  // namespace

Weights findWeights(const mesh::Mesh& mesh, bool prove, std::size_t most_steps) {
  return Search(mesh, most_steps)(prove);
}

}  // namespace spillikin::sort
