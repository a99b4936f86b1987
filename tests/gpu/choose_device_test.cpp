// Which device is chosen, of devices that this machine need not have.
#include <gtest/gtest.h>

#include "gpu/choose_device.h"

namespace marrow::test {
namespace {

using gpu::DeviceKind;
using gpu::internal::Choices;
using gpu::internal::choose_among;

Choices choices(std::vector<gpu::Device> usable) {
    return {std::move(usable), {}, "no Vulkan driver is installed"};
}

const Choices kLaptop = choices({{"Intel(R) UHD Graphics 630", DeviceKind::integrated},
                                 {"llvmpipe (LLVM 15.0.6, 256 bits)", DeviceKind::software},
                                 {"NVIDIA GeForce RTX 3050", DeviceKind::discrete}});
const Choices kServer = choices({{"llvmpipe (LLVM 15.0.6, 256 bits)", DeviceKind::software}});
const Choices kTwins = choices({{"NVIDIA A2", DeviceKind::discrete}, {"NVIDIA A2", DeviceKind::discrete}});

std::string refusal(const Choices& among, std::string_view choice) {
    try {
        choose_among(among, choice);
    } catch (const gpu::DeviceError& error) {
        return error.what();
    }
    return "none";
}

TEST(ChooseDevice, CpuIsNoDevice) {
    EXPECT_EQ(choose_among(kLaptop, "cpu"), std::nullopt);
    EXPECT_EQ(gpu::choose_device("cpu"), std::nullopt);
}

TEST(ChooseDevice, AutoAndGpuPreferTheGraphicsCard) {
    EXPECT_EQ(choose_among(kLaptop, "auto"), 2u);
    EXPECT_EQ(choose_among(kLaptop, "gpu"), 2u);
    EXPECT_EQ(choose_among(kTwins, "auto"), 0u);
    Choices without_card = kLaptop;
    without_card.usable.pop_back();
    EXPECT_EQ(choose_among(without_card, "auto"), 0u);
}

TEST(ChooseDevice, SoftwareDevicesAreUsedOnlyIfTheyAreNamed) {
    EXPECT_EQ(choose_among(kServer, "auto"), std::nullopt);
    EXPECT_EQ(
        refusal(kServer, "gpu"),
        "there is no GPU: device 0 (llvmpipe (LLVM 15.0.6, 256 bits)) is emulated by the CPU, so it is used "
        "only if its number or name is given");
    Choices with_old_card = kServer;
    with_old_card.unusable = {{{"GeForce GTX 480", DeviceKind::discrete}, "it has no Vulkan 1.2"}};
    EXPECT_TRUE(
        refusal(with_old_card, "gpu").ends_with("; GeForce GTX 480 cannot be used, as it has no Vulkan 1.2"));
    EXPECT_EQ(choose_among(kServer, "0"), 0u);
    EXPECT_EQ(choose_among(kServer, "llvmpipe"), 0u);
    EXPECT_EQ(choose_among(kLaptop, "1"), 1u);
}

TEST(ChooseDevice, APartOfTheNameSufficesInAnyCase) {
    EXPECT_EQ(choose_among(kLaptop, "nvidia"), 2u);
    EXPECT_EQ(choose_among(kLaptop, "UHD"), 0u);
    EXPECT_EQ(choose_among(kLaptop, "rtx 3050"), 2u);
}

TEST(ChooseDevice, TheWholeNameNamesADeviceThoughItIsAPartOfAnother) {
    const Choices cards =
        choices({{"NVIDIA A2000", DeviceKind::discrete}, {"NVIDIA A2", DeviceKind::discrete}});
    EXPECT_EQ(choose_among(cards, "NVIDIA A2"), 1u);
    EXPECT_EQ(choose_among(cards, "nvidia a2"), 1u);
    EXPECT_EQ(choose_among(cards, "a2000"), 0u);
    EXPECT_TRUE(refusal(cards, "A2").starts_with("several devices have 'A2' in their names"));
    EXPECT_TRUE(refusal(kTwins, "NVIDIA A2").starts_with("several devices have 'NVIDIA A2' in their names"));
}

TEST(ChooseDevice, TheWordsHaveAnyCase) {
    EXPECT_EQ(choose_among(kLaptop, "CPU"), std::nullopt);
    EXPECT_EQ(gpu::choose_device("Cpu"), std::nullopt);
    EXPECT_EQ(choose_among(kLaptop, "Auto"), 2u);
    EXPECT_EQ(choose_among(kLaptop, "GPU"), 2u);
}

TEST(ChooseDevice, DigitsAloneAreANumber) {
    EXPECT_EQ(choose_among(kLaptop, "0"), 0u);
    EXPECT_TRUE(refusal(kLaptop, "3050").starts_with("there is no device '3050'"));
}

TEST(ChooseDevice, SaysWhatThereIsInstead) {
    EXPECT_EQ(refusal(kTwins, "2"), "there is no device '2': there is 0 (NVIDIA A2), 1 (NVIDIA A2)");
    EXPECT_EQ(refusal(kServer, "256"),
              "there is no device '256': there is 0 (llvmpipe (LLVM 15.0.6, 256 bits))");
    EXPECT_EQ(refusal(kTwins, "99999999999999999999"),
              "there is no device '99999999999999999999': there is 0 (NVIDIA A2), 1 (NVIDIA A2)");
    EXPECT_EQ(refusal(kTwins, ""), "there is no device '': there is 0 (NVIDIA A2), 1 (NVIDIA A2)");
    EXPECT_EQ(refusal(kTwins, "-1"), "there is no device '-1': there is 0 (NVIDIA A2), 1 (NVIDIA A2)");
    EXPECT_EQ(
        refusal(kTwins, "a2"),
        "several devices have 'a2' in their names: give the number of one, 0 (NVIDIA A2), 1 (NVIDIA A2)");
    EXPECT_EQ(refusal(choices({}), "gpu"), "there is no GPU: no Vulkan driver is installed");
    EXPECT_EQ(refusal(choices({}), "0"), "there is no device '0': no Vulkan driver is installed");
    EXPECT_EQ(choose_among(choices({}), "auto"), std::nullopt);
}

TEST(ChooseDevice, SaysWhyADeviceCannotBeUsed) {
    const Choices old{{}, {{{"GeForce GT 610", DeviceKind::discrete}, "it has no Vulkan 1.2"}}, {}};
    EXPECT_EQ(refusal(old, "gpu"), "there is no GPU: GeForce GT 610 cannot be used, as it has no Vulkan 1.2");
    EXPECT_EQ(choose_among(old, "auto"), std::nullopt);
}

}  // namespace
}  // namespace marrow::test
