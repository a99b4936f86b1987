// What the plugin exports.
#pragma once

/// \throw marrow::InputError always
__attribute__((visibility("default"))) void fail_in_plugin();
