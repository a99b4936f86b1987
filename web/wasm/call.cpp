// The face of the module: one function that takes a request and one that returns its answer.
#include <emscripten.h>

#include <map>
#include <new>
#include <string>

#include "base/parallel.h"
#include "base/pool_limit.h"
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

std::string answer;

int fail(const std::string& message, int code) {
    answer = Json{{"message", message}}.dump(-1, ' ', false, Json::error_handler_t::replace);
    return code;
}

}  // namespace

EM_JS(int, marrow_progress, (double fraction), { return Module["onProgress"](fraction) ? 1 : 0; });

Progress progress() {
    // The other threads have no JavaScript of their own; the calling thread takes part in all loops and reports for them.
    return [](double fraction) { return internal::pool_thread() != 0 || marrow_progress(fraction) != 0; };
}

}  // namespace marrow::web

extern "C" {

/// Does the work of a request, JSON with the member `operation`. Returns 0 or the exit code of the command
/// line.
EMSCRIPTEN_KEEPALIVE int marrow_call(const char* request) {
    using namespace marrow;
    using web::Json;
    try {
        const Json parsed = Json::parse(request);
        web::answer = web::kOperations.at(parsed.at("operation").get<std::string>())(parsed).dump(
            -1, ' ', false, Json::error_handler_t::replace);
        return 0;
    } catch (const Error& error) {
        return web::fail(error.what(), apps::exit_code_of(error));
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
