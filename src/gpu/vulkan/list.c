/* The instance, and which of its devices can be used: Vulkan 1.3, a compute queue, push descriptors and timeline
 * semaphores (core). Listing creates an instance and destroys it again; nothing is kept. Any thread. */
#include "gpu/vulkan/vk.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
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

static VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                                 VkDebugUtilsMessageTypeFlagsEXT types,
                                                 const VkDebugUtilsMessengerCallbackDataEXT *data, void *context)
{
    (void)types;
    (void)context;
    /* The loader's own remarks about other drivers are not about what we do. */
    if (data->pMessageIdName && !strncmp(data->pMessageIdName, "Loader", 6))
        return VK_FALSE;
    spl_gpu_complain("vulkan", severity & VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT, data->pMessage);
    return VK_FALSE;
}

static bool has_layer(const char *name)
{
    VkLayerProperties layers[64];
    uint32_t count = 64;
    if (vkEnumerateInstanceLayerProperties(&count, layers) < 0)
        return false;
    for (uint32_t i = 0; i < count; i++)
        if (!strcmp(layers[i].layerName, name))
            return true;
    return false;
}

int vk_instance_create(bool debug, VkInstance *out, VkDebugUtilsMessengerEXT *messenger, struct spl_error *err)
{
    static const char *const layer = "VK_LAYER_KHRONOS_validation", *const extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
    uint32_t version = 0;
    if (vkEnumerateInstanceVersion(&version) < 0 || version < VK_API_VERSION_1_3)
        return spl_fail(err, SPL_E_NO_DEVICE, "vulkan: the loader has version %u.%u; 1.3 is needed",
                        VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version));
    if (debug && !has_layer(layer)) {
        spl_log_warn("%s is not installed (Debian: vulkan-validationlayers); rendering goes on unchecked", layer);
        debug = false;
    }
    VkDebugUtilsMessengerCreateInfoEXT reports = {
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
        .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                           VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
        .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT |
                       VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT,
        .pfnUserCallback = on_message,
    };
    VkResult result = vkCreateInstance(
        &(VkInstanceCreateInfo){
            .sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
            .pNext = debug ? &reports : NULL,
            .pApplicationInfo = &(VkApplicationInfo){.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                                     .pApplicationName = "splatd",
                                                     .apiVersion = VK_API_VERSION_1_3},
            .enabledLayerCount = debug,
            .ppEnabledLayerNames = &layer,
            .enabledExtensionCount = debug,
            .ppEnabledExtensionNames = &extension,
        },
        NULL, out);
    if (result < 0)
        return vk_fail(err, SPL_E_NO_DEVICE, result, "no instance");
    if (debug) {
        PFN_vkCreateDebugUtilsMessengerEXT create =
            (PFN_vkCreateDebugUtilsMessengerEXT)vkGetInstanceProcAddr(*out, "vkCreateDebugUtilsMessengerEXT");
        create(*out, &reports, NULL, messenger);
    }
    return 0;
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
    VkInstance instance = VK_NULL_HANDLE;
    size_t count = 0;
    if (vk_instance_create(false, &instance, NULL, &err) < 0) {
        snprintf(info.unusable, sizeof info.unusable, "%.*s", (int)sizeof info.unusable - 1, err.message);
        if (capacity)
            devices[0] = info;
        return 1;
    }
    VkPhysicalDevice device;
    for (; vk_device_get(instance, (uint32_t)count, &device, &info, NULL); count++)
        if (count < capacity)
            devices[count] = info;
    vkDestroyInstance(instance, NULL);
    return count;
}
