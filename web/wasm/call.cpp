// The face of the module: one function that takes a request and one that returns its answer.
#include <emscripten.h>

#include <map>
#include <new>
#include <set>
#include <string>

#include "base/parallel.h"
#include "base/pool_limit.h"
#include "codecs/needed.h"
#include "json.h"
#include "shared/console.h"

namespace marrow::web {
namespace {

// The first request: how many threads JavaScript has started.
Json threads(const Json& request) {
    internal::limit_pool(request.at("threads").get<int>());
    return {{"threads", internal::thread_count()}};
}

const std::map<std::string, Operation> kOperations{
    {"threads", threads},
    {"inspect", inspect},
    {"read", read},
    {"adopt", adopt},
    {"describe", describe_scan},
    {"labelTable", read_labels},
    {"slice", slice},
    {"createExtractor", create_extractor},
    {"extract", extract},
    {"dropExtractor", drop_extractor},
    {"labels", labels},
    {"createMesh", create_mesh},
    {"dropMesh", drop_mesh},
    {"keepComponents", keep_components},
    {"smooth", smooth},
    {"simplify", simplify},
    {"measure", measure},
    {"check", check},
    {"write", write},
};

// An InputError of these may be about a file or the samples. The others look at no more than their arguments.
const std::set<std::string> kReaders{"inspect", "read", "labelTable", "labels"};

constexpr int kNeedsCodecs = -1;

std::string answer;

int give(const Json& json, int code) {
    answer = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    return code;
}

int fail(const std::string& message, int code) {
    return give({{"message", message}}, code);
}

int code_of(const Error& error, const std::string& operation) {
    const int code = apps::exit_code_of(error);
    const bool is_input = code == apps::kUnreadable && dynamic_cast<const InputError*>(&error) != nullptr;
    if (is_input && !kReaders.contains(operation)) return apps::kUsage;
    return code;
}

}  // namespace

EM_JS(int, marrow_progress, (double fraction), { return Module["onProgress"](fraction) ? 1 : 0; });

Progress progress() {
    // The other threads have no JavaScript of their own; the calling thread takes part in
    // all loops and reports for them.
    return [](double fraction) { return internal::pool_thread() != 0 || marrow_progress(fraction) != 0; };
}

}  // namespace marrow::web

extern "C" {

/// Does the work of a request, JSON with the member `operation`. Returns 0, or the exit code of the command
/// line, or -1: the module with codecs can do it.
EMSCRIPTEN_KEEPALIVE int marrow_call(const char* request) {
    using namespace marrow;
    using web::Json;
    web::take_need_of_codecs();
    std::string operation;
    try {
        const Json parsed = Json::parse(request);
        operation = parsed.at("operation").get<std::string>();
        const Json result = web::kOperations.at(operation)(parsed);
        // A report may tell of files that could not be decoded.
        if (web::take_need_of_codecs()) return web::fail("needs codecs", web::kNeedsCodecs);
        return web::give(result, 0);
    } catch (const Error& error) {
        if (web::take_need_of_codecs()) return web::fail("needs codecs", web::kNeedsCodecs);
        return web::fail(error.what(), web::code_of(error, operation));
    } catch (const std::bad_alloc&) {
        return web::fail("not enough memory for this input", apps::kUnreadable);
    } catch (const std::exception& error) {
        return web::fail(error.what(), apps::kUsage);
    }
}

/// The answer to the last request, JSON: the result, or the `message` of an error.
EMSCRIPTEN_KEEPALIVE const char* marrow_answer() {
    return marrow::web::answer.c_str();
}
}
