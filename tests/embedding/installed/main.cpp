// Turns the scan that is named first into the mesh that is named second, and catches an error of the plugin.
#include "plugin.h"

#include <marrow/marrow.h>

int main(int, char** arguments) {
    const marrow::Volume scan = marrow::read_scan(arguments[1]);
    const marrow::Mesh skull = marrow::extract_isosurface(scan, 0.5, {.closed = true});
    marrow::write_mesh(skull, arguments[2]);
    try {
        fail_in_plugin();
    } catch (const marrow::InputError&) {
        return 0;
    }
    return 1;
}
