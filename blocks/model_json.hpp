// Models as JSON text and files.
#pragma once

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/registry.hpp>

#include <filesystem>
#include <string>
#include <string_view>

namespace blockid {

/// The model as JSON:
///
///   {"format": "blockid-model", "version": 1,
///    "chain": "G=rational(nb=1,na=1) | f=polynomial(degree=1,range=[-1,1])",
///    "sample_time_s": 0.1,
///    "input": {"name": "u", "unit": "V"}, "output": {"name": "y", "unit": ""},
///    "parameters": [{"name": "G.b0", "value": 0.5, "standard_deviation": 0.01}, ...],     (n_theta,)
///    "initial_state": []}                                                                 (n_x,) or empty for rest
///
/// `standard_deviation` stands with every parameter or with none. Numbers read back bit for bit. Throws Error for what
/// check() refuses, a block without kind() (nothing could read it back), and names or units that are no UTF-8.
std::string to_json(const Model& model);

/// The model that to_json() wrote; `input`, `output` and `initial_state` may be absent. Parameter names must be those
/// of the chain, in its order.
///
/// Throws Error with the JSON pointer of the place, what was expected and what came: not JSON, another format or
/// version, members that are missing, unknown or come twice, values of another type, numbers beyond a double, counts
/// and names that do not fit the chain, and a chain that parse() refuses.
Model model_from_json(std::string_view text, const Registry& registry = standard_registry());

/// Writes to_json(model) so that a reader sees the old file or the new, never a part. Throws Error naming the file.
void save_model(const std::filesystem::path& path, const Model& model);

/// Throws Error naming the file, and as model_from_json().
Model load_model(const std::filesystem::path& path, const Registry& registry = standard_registry());

}  // namespace blockid
