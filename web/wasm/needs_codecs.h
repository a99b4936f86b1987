/// Tells JavaScript that a scan needs the module with codecs.
#pragma once

namespace marrow::web {

/// It is no Error, so that nothing on its way takes it for a fault of the scan.
struct NeedsCodecs {};

/// What marrow_call returns for it.
inline constexpr int kNeedsCodecs = -1;

}  // namespace marrow::web
