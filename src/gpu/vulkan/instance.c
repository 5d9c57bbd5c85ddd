/* The instance, one per process (two once something is opened for debugging), made when first asked for and never given
 * back: with it would go all drivers, whose unloading and loading again is slow and leaks inside them. Any thread. */
#include "gpu/vulkan/vk.h"

#include <pthread.h>
#include <string.h>

#include "base/log.h"

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static VkInstance instances[2]; // guarded by: mutex; plain, debugging

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

static int create(bool debug, VkInstance *out, struct spl_error *err)
{
    static const char *const layer = "VK_LAYER_KHRONOS_validation";
    static const char *const extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
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
        VkDebugUtilsMessengerEXT messenger;
        PFN_vkCreateDebugUtilsMessengerEXT create_messenger =
            (PFN_vkCreateDebugUtilsMessengerEXT)vkGetInstanceProcAddr(*out, "vkCreateDebugUtilsMessengerEXT");
        create_messenger(*out, &reports, NULL, &messenger);
    }
    return 0;
}

int vk_instance_get(bool debug, VkInstance *out, struct spl_error *err)
{
    int code = 0;
    pthread_mutex_lock(&mutex);
    if (!instances[debug])
        code = create(debug, &instances[debug], err);
    *out = instances[debug];
    pthread_mutex_unlock(&mutex);
    return code;
}
