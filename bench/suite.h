// On what accuracy is judged: the meshes of a folder, the views and the transfer functions, the same for Spillikin's
// own backends and for its peers.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "spillikin/base/view.h"
#include "spillikin/integrate/transfer_function.h"
#include "spillikin/mesh/source.h"
#include "spillikin/render/session.h"

namespace spillikin::bench {

struct Look {
  const char* label;
  const char* preset;
};
inline constexpr std::array<Look, 3> looks{{{"smooth", "viridis"}, {"jumping", "steps"}, {"comb", "comb"}}};

// The preset over the field's range, as dense as the default look.
integrate::TransferFunction lookOf(const render::Session& session, const char* preset);

// Three views: perspective from the front and from aslant, parallel from aslant.
std::vector<View> views(const render::Session& session, int size);

// The mesh of a file. One without any array gets a smooth point array made of its coordinates, so that there is a field
// to be judged on. Throws Error.
mesh::Source read(const std::filesystem::path& path);
inline constexpr const char* made_field = "made from the coordinates";

// The files of a folder, and of those in it, that are meshes by their suffix; sorted.
std::vector<std::filesystem::path> meshes(const std::filesystem::path& folder);

// A message as it reads wherever the folder of `path` lies.
std::string withoutFolder(std::string message, const std::filesystem::path& path);

}  // namespace spillikin::bench
