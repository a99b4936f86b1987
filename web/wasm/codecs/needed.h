/// Whether a request met data of a codec that this module does not have; the module with codecs does it then.
#pragma once

namespace marrow::web {

/// Notes that codecs are needed. Any thread may call it.
void need_codecs();

/// Whether need_codecs() was called since the last time that this was asked.
bool take_need_of_codecs();

}  // namespace marrow::web
