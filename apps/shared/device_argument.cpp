// Declares the option that chooses a device.
#include "device_argument.h"

namespace marrow::apps {

void add_device_option(Arguments& arguments, std::string& device) {
    arguments.start_group("General");
    arguments.add_option(
        "--device", text_value("DEVICE", device),
        "Extract on DEVICE: cpu; auto, a GPU if there is one; gpu; or a device in 'marrow devices', by its "
        "number (digits alone), its name or a part of that. Default: " +
            device + ". The surface is the same.");
}

}  // namespace marrow::apps
