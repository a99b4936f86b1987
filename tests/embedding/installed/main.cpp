// Turns the scan that is named first into the mesh that is named second.
#include <marrow/marrow.h>

int main(int, char** arguments) {
    const marrow::Volume scan = marrow::read_scan(arguments[1]);
    const marrow::Mesh skull = marrow::extract_isosurface(scan, 0.5, {.closed = true});
    marrow::write_mesh(skull, arguments[2]);
}
