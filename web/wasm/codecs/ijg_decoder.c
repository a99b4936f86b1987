// Decodes JPEG by DCMTK's form of the Independent JPEG Group's library. It is compiled for samples of up to 8, 12 and 16
// bits, as the library is: IJG_BITS.
#include <setjmp.h>
#include <stdio.h>  // the library's headers need it before them
#include <string.h>

#if IJG_BITS == 8
#include "jpeglib8.h"
#elif IJG_BITS == 12
#include "jpeglib12.h"
#else
#include "jpeglib16.h"
#endif

#define NAME_WITH(bits) marrow_decode_ijg##bits
#define NAME_OF(bits) NAME_WITH(bits)

struct Faults {
    struct jpeg_error_mgr manager;
    jmp_buf stop;
};

static void stop(j_common_ptr info) {
    longjmp(((struct Faults*)info->err)->stop, 1);
}

// The library completes damaged images and warns. Here a warning is an error.
static void stop_at_warning(j_common_ptr info, int level) {
    if (level < 0) stop(info);
}

static void nothing(j_decompress_ptr info) {
    (void)info;
}

static boolean no_more(j_decompress_ptr info) {
    stop((j_common_ptr)info);
    return FALSE;
}

static void skip(j_decompress_ptr info, long count) {
    if (count <= 0) return;
    if ((size_t)count > info->src->bytes_in_buffer) stop((j_common_ptr)info);
    info->src->next_input_byte += count;
    info->src->bytes_in_buffer -= (size_t)count;
}

// Returns 1, or 0 if the stream is damaged or its image does not have the size of `to`.
int NAME_OF(IJG_BITS)(const unsigned char* stream, size_t size, unsigned char* to, size_t to_size) {
    struct jpeg_decompress_struct info;
    struct Faults faults;
    struct jpeg_source_mgr source;
    memset(&info, 0, sizeof info);
    memset(&source, 0, sizeof source);
    info.err = jpeg_std_error(&faults.manager);
    faults.manager.error_exit = stop;
    faults.manager.emit_message = stop_at_warning;
    if (setjmp(faults.stop)) {
        jpeg_destroy_decompress(&info);
        return 0;
    }
    jpeg_create_decompress(&info);
    source.next_input_byte = stream;
    source.bytes_in_buffer = size;
    source.init_source = nothing;
    source.fill_input_buffer = no_more;
    source.skip_input_data = skip;
    source.resync_to_restart = jpeg_resync_to_restart;
    source.term_source = nothing;
    info.src = &source;
    jpeg_read_header(&info, TRUE);
    info.jpeg_color_space = info.out_color_space = JCS_UNKNOWN;  // one component stays as it is
    jpeg_start_decompress(&info);
    const size_t row = (size_t)info.output_width * (size_t)info.output_components * sizeof(JSAMPLE);
    if (row * info.output_height != to_size) stop((j_common_ptr)&info);
    while (info.output_scanline < info.output_height) {
        JSAMPROW line = (JSAMPROW)(to + info.output_scanline * row);
        jpeg_read_scanlines(&info, &line, 1);
    }
    jpeg_finish_decompress(&info);
    jpeg_destroy_decompress(&info);
    return 1;
}
