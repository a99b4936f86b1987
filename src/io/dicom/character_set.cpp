// Converts the text of DICOM files to UTF-8 by DCMTK.
#include "character_set.h"

#define HAVE_CONFIG_H  // required by DCMTK's headers
#include <dcmtk/config/osconfig.h>

#include <dcmtk/dcmdata/dcspchrs.h>
#include <dcmtk/oflog/oflog.h>

namespace marrow::internal::io {

std::optional<std::string> to_utf8(const std::string& text, const std::string& character_set) {
    static const bool quiet = [] {  // otherwise it prints what is wrong with the text
        for (const char* name : {"dcmtk.dcmdata", "dcmtk.ofstd"})
            OFLog::getLogger(name).setLogLevel(OFLogger::OFF_LOG_LEVEL);
        return true;
    }();
    static_cast<void>(quiet);
    DcmSpecificCharacterSet converter;
    OFString out;
    if (converter.selectCharacterSet(OFString(character_set.data(), character_set.size())).bad() ||
        converter.convertString(text.data(), text.size(), out, "\\^=").bad())
        return {};
    return std::string(out.c_str(), out.size());
}

}  // namespace marrow::internal::io
