#include "spillikin/composite/compositor.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "spillikin/base/error.h"
#include "spillikin/composite/backends.h"

namespace spillikin::composite {

namespace {

constexpr std::array<std::pair<Backend, const char*>, 4> backends{
    {{Backend::automatic, "auto"}, {Backend::native, "native"}, {Backend::osmesa, "osmesa"}, {Backend::egl, "egl"}}};
constexpr std::array<std::pair<Integration, const char*>, 4> integrations{
    {{Integration::exact, "exact"},
     {Integration::preintegrated, "preintegrated"},
     {Integration::average, "average"},
     {Integration::vertex, "vertex"}}};
constexpr std::array<std::pair<Walking, const char*>, 3> walkings{
    {{Walking::automatic, "auto"}, {Walking::never, "never"}, {Walking::always, "always"}}};

template <class Table, class Value>
const char* nameIn(const Table& table, Value value) {
  for (const auto& [entry, text] : table) {
    if (entry == value) {
      return text;
    }
  }
  return "unknown";
}

template <class Table>
auto valueIn(const Table& table, std::string_view name, const char* what) {
  std::string known;
  for (const auto& [entry, text] : table) {
    if (name == text) {
      return entry;
    }
    known += known.empty() ? text : std::string(", ") + text;
  }
  throw Error(fmt::format("{} '{}' is unknown; choose one of {}", what, name, known));
}

}  // namespace

const char* name(Backend backend) {
  return nameIn(backends, backend);
}

const char* name(Integration integration) {
  return nameIn(integrations, integration);
}

const char* name(Walking walking) {
  return nameIn(walkings, walking);
}

Backend backend(std::string_view name) {
  return valueIn(backends, name, "backend");
}

Integration integration(std::string_view name) {
  return valueIn(integrations, name, "integration");
}

Walking walking(std::string_view name) {
  return valueIn(walkings, name, "way to walk");
}

std::unique_ptr<Compositor> makeCompositor(Backend backend) {
  switch (backend) {
    case Backend::osmesa:
      return makeOsmesa();
    case Backend::egl:
      return makeEgl();
    case Backend::automatic:
    case Backend::native:
      break;
  }
  return makeNative();
}

}  // namespace spillikin::composite
