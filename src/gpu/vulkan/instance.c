/* Instances, made when first asked for and kept for the life of the process: with the last would go all drivers, whose
 * unloading and loading again is slow and leaks inside them. Each device that is open has one to itself, as software
 * drivers run what all devices of an instance are given one after the other; those that are debugged share one, since
 * the validation layer leaks what it knows of a second. Any thread. */
#include "gpu/vulkan/vk.h"

#include <limits.h>
#include <pthread.h>
#include <string.h>

#include "base/log.h"

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static struct {
    VkInstance instance;
    bool debug;
    unsigned devices; /* that are open on it */
} known[32];              // guarded by: mutex, as is:
static size_t known_count;

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
    static const char *const extensions[] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME,
                                             VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
    /* Software drivers run one command after another: whether a barrier is missing, that layer alone sees there. */
    static const VkValidationFeatureEnableEXT hazards = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
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
    const VkValidationFeaturesEXT checks = {.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
                                            .pNext = &reports,
                                            .enabledValidationFeatureCount = 1,
                                            .pEnabledValidationFeatures = &hazards};
    VkResult result = vkCreateInstance(
        &(VkInstanceCreateInfo){
            .sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
            .pNext = debug ? &checks : NULL,
            .pApplicationInfo = &(VkApplicationInfo){.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                                     .pApplicationName = "splatd",
                                                     .apiVersion = VK_API_VERSION_1_3},
            .enabledLayerCount = debug,
            .ppEnabledLayerNames = &layer,
            .enabledExtensionCount = debug ? sizeof extensions / sizeof *extensions : 0,
            .ppEnabledExtensionNames = extensions,
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

/* The one with the fewest devices, which must be `devices` at most; NULL: none. With the mutex held. */
static VkInstance find(bool debug, unsigned devices, bool takes)
{
    size_t best = known_count;
    for (size_t i = 0; i < known_count; i++)
        if (known[i].debug == debug && known[i].devices <= devices &&
            (best == known_count || known[i].devices < known[best].devices))
            best = i;
    if (best == known_count)
        return NULL;
    known[best].devices += takes;
    return known[best].instance;
}

static int get(bool debug, bool takes, VkInstance *out, struct spl_error *err)
{
    const size_t most = sizeof known / sizeof *known;
    int code = 0;
    pthread_mutex_lock(&mutex);
    *out = find(debug, takes && !debug ? 0 : UINT_MAX, takes);
    if (!*out && known_count == most)
        *out = find(debug, UINT_MAX, takes);
    if (!*out && known_count == most)
        code = spl_fail(err, SPL_E_LIMIT, "vulkan: %zu devices are open", most);
    if (!*out && !code && !(code = create(debug, out, err))) {
        known[known_count].instance = *out;
        known[known_count].debug = debug;
        known[known_count++].devices = takes;
    }
    pthread_mutex_unlock(&mutex);
    return code;
}

int vk_instance_get(VkInstance *out, struct spl_error *err)
{
    return get(false, false, out, err);
}

int vk_instance_take(bool debug, VkInstance *out, struct spl_error *err)
{
    return get(debug, true, out, err);
}

void vk_instance_give_back(VkInstance instance)
{
    pthread_mutex_lock(&mutex);
    for (size_t i = 0; i < known_count; i++)
        known[i].devices -= instance && known[i].instance == instance;
    pthread_mutex_unlock(&mutex);
}
