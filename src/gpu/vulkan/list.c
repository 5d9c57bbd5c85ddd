/* Which devices can be used: Vulkan 1.3 (with it timeline semaphores), a compute queue, push descriptors. Nothing is
 * kept. Any thread. */
#include "gpu/vulkan/vk.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

enum { DEVICES_MAX = 64 };

static const char *result_name(VkResult result)
{
    switch (result) {
    case VK_ERROR_OUT_OF_HOST_MEMORY:
        return "out of host memory";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
        return "out of device memory";
    case VK_ERROR_INITIALIZATION_FAILED:
        return "initialisation failed";
    case VK_ERROR_DEVICE_LOST:
        return "device lost";
    case VK_ERROR_MEMORY_MAP_FAILED:
        return "memory map failed";
    case VK_ERROR_LAYER_NOT_PRESENT:
        return "layer not present";
    case VK_ERROR_EXTENSION_NOT_PRESENT:
        return "extension not present";
    case VK_ERROR_FEATURE_NOT_PRESENT:
        return "feature not present";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
        return "no driver is installed (Debian: mesa-vulkan-drivers)";
    default:
        return NULL;
    }
}

int vk_fail(struct spl_error *err, int code, VkResult result, const char *what)
{
    if (result == VK_ERROR_DEVICE_LOST)
        code = SPL_E_DEVICE_LOST;
    const char *name = result_name(result);
    if (name)
        return spl_fail(err, code, "vulkan: %s: %s", what, name);
    return spl_fail(err, code, "vulkan: %s: VkResult %d", what, (int)result);
}

static bool has_push_descriptors(VkPhysicalDevice device)
{
    uint32_t count = 0;
    bool found = false;
    if (vkEnumerateDeviceExtensionProperties(device, NULL, &count, NULL) < 0)
        return false;
    VkExtensionProperties *all = spl_alloc(count, sizeof *all, NULL);
    if (all && vkEnumerateDeviceExtensionProperties(device, NULL, &count, all) >= 0)
        for (uint32_t i = 0; i < count && !found; i++)
            found = !strcmp(all[i].extensionName, VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME);
    free(all);
    return found;
}

/* A compute family; one without graphics (an asynchronous queue of its own) is no better for us. */
static bool find_family(VkPhysicalDevice device, uint32_t *family)
{
    VkQueueFamilyProperties families[16];
    uint32_t count = 16;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families);
    for (*family = 0; *family < count; ++*family)
        if (families[*family].queueFlags & VK_QUEUE_COMPUTE_BIT)
            return true;
    return false;
}

bool vk_device_get(VkInstance instance, uint32_t index, VkPhysicalDevice *out, struct spl_device_info *info,
                   uint32_t *family)
{
    VkPhysicalDevice devices[DEVICES_MAX];
    uint32_t count = DEVICES_MAX, own_family;
    if (vkEnumeratePhysicalDevices(instance, &count, devices) < 0 || index >= count)
        return false;
    *out = devices[index];
    VkPhysicalDeviceDriverProperties driver = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
    VkPhysicalDeviceIDProperties id = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES, .pNext = &driver};
    VkPhysicalDeviceProperties2 properties = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &id};
    vkGetPhysicalDeviceProperties2(*out, &properties);
    VkPhysicalDeviceFeatures features;
    vkGetPhysicalDeviceFeatures(*out, &features);
    uint32_t version = properties.properties.apiVersion;

    *info = (struct spl_device_info){.backend = "vulkan", .index = index};
    snprintf(info->name, sizeof info->name, "%s", properties.properties.deviceName);
    snprintf(info->driver, sizeof info->driver, "%.127s %.127s", driver.driverName, driver.driverInfo);
    memcpy(info->uuid, id.deviceUUID, sizeof info->uuid);
    info->software = properties.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
    if (version < VK_API_VERSION_1_3)
        snprintf(info->unusable, sizeof info->unusable, "it has Vulkan %u.%u; 1.3 is needed",
                 VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version));
    else if (!find_family(*out, family ? family : &own_family))
        snprintf(info->unusable, sizeof info->unusable, "it has no compute queue");
    else if (!has_push_descriptors(*out))
        snprintf(info->unusable, sizeof info->unusable, "it lacks " VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME);
    return true;
}

size_t vk_list(struct spl_device_info *devices, size_t capacity)
{
    struct spl_error err = {0};
    struct spl_device_info info = {.backend = "vulkan", .name = "none"};
    VkInstance instance;
    size_t count = 0;
    if (vk_instance_get(&instance, &err) < 0) {
        snprintf(info.unusable, sizeof info.unusable, "%.*s", (int)sizeof info.unusable - 1, err.message);
        if (capacity)
            devices[0] = info;
        return 1;
    }
    VkPhysicalDevice device;
    for (; vk_device_get(instance, (uint32_t)count, &device, &info, NULL); count++)
        if (count < capacity)
            devices[count] = info;
    return count;
}
