/* Opening and closing a Vulkan device, and the backend's table. One compute queue. Owned by the thread that opens
 * it. */
#include "gpu/vulkan/vk.h"

#include <stdlib.h>

#include "base/memory.h"

static void vk_close(struct spl_gpu *base)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    if (gpu->device) {
        if (!base->lost)
            vk_cache_save(gpu);
        vk_frames_finish(gpu);
        vkDestroyPipelineCache(gpu->device, gpu->cache, NULL);
        vkDestroyDevice(gpu->device, NULL);
    }
    vk_instance_give_back(gpu->instance);
    free(gpu);
}

static uint64_t min64(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

/* Reads what the device can do into base.limits and the backend's own fields. */
static void read_limits(struct vk_gpu *gpu, VkPhysicalDeviceProperties *properties, bool atomics_64)
{
    VkPhysicalDeviceMaintenance4Properties maintenance4 = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES};
    VkPhysicalDeviceMaintenance3Properties maintenance3 = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES, .pNext = &maintenance4};
    VkPhysicalDeviceProperties2 all = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &maintenance3};
    vkGetPhysicalDeviceProperties2(gpu->physical, &all);
    *properties = all.properties;
    vkGetPhysicalDeviceMemoryProperties(gpu->physical, &gpu->memory);
    VkQueueFamilyProperties families[16];
    uint32_t count = 16;
    vkGetPhysicalDeviceQueueFamilyProperties(gpu->physical, &count, families);
    uint32_t bits = families[gpu->family].timestampValidBits;

    struct spl_gpu_limits *limits = &gpu->base.limits;
    for (uint32_t i = 0; i < gpu->memory.memoryHeapCount; i++)
        if (gpu->memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT &&
            gpu->memory.memoryHeaps[i].size > limits->memory_bytes)
            limits->memory_bytes = gpu->memory.memoryHeaps[i].size;
    /* lavapipe says 2 GiB on any machine. */
    if (gpu->base.info.software)
        limits->memory_bytes = spl_gpu_host_memory();
    limits->buffer_bytes = min64(maintenance3.maxMemoryAllocationSize, maintenance4.maxBufferSize);
    limits->binding_bytes = min64(properties->limits.maxStorageBufferRange,
                                  UINT64_C(4) * properties->limits.maxTexelBufferElements);
    limits->workgroups = properties->limits.maxComputeWorkGroupCount[0];
    limits->atomics_64 = atomics_64;
    limits->timestamps = bits > 0;
    gpu->timestamp_period_ns = properties->limits.timestampPeriod;
    gpu->timestamp_mask = bits >= 64 ? UINT64_MAX : (UINT64_C(1) << bits) - 1;
}

static int create_device(struct vk_gpu *gpu, bool *atomics_64, struct spl_error *err)
{
    VkPhysicalDeviceVulkan13Features have13 = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    VkPhysicalDeviceVulkan12Features have12 = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
                                               .pNext = &have13};
    VkPhysicalDeviceFeatures2 have = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, .pNext = &have12};
    vkGetPhysicalDeviceFeatures2(gpu->physical, &have);
    *atomics_64 = have.features.shaderInt64 && have12.shaderBufferInt64Atomics;

    /* Robust access: no dataset, however damaged, makes a kernel touch memory outside its bindings. Timeline
     * semaphores, synchronization2 and maintenance4 belong to every Vulkan 1.3. */
    VkPhysicalDeviceVulkan13Features want13 = {.sType = have13.sType, .synchronization2 = VK_TRUE,
                                               .maintenance4 = VK_TRUE};
    VkPhysicalDeviceVulkan12Features want12 = {.sType = have12.sType, .pNext = &want13, .timelineSemaphore = VK_TRUE,
                                               .shaderBufferInt64Atomics = *atomics_64};
    VkPhysicalDeviceFeatures2 want = {.sType = have.sType, .pNext = &want12,
                                      .features = {.robustBufferAccess = VK_TRUE, .shaderInt64 = *atomics_64}};
    VkResult result = vkCreateDevice(
        gpu->physical,
        &(VkDeviceCreateInfo){.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                              .pNext = &want,
                              .queueCreateInfoCount = 1,
                              .pQueueCreateInfos =
                                  &(VkDeviceQueueCreateInfo){.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                                             .queueFamilyIndex = gpu->family,
                                                             .queueCount = 1,
                                                             .pQueuePriorities = &(float){1}},
                              .enabledExtensionCount = 1,
                              .ppEnabledExtensionNames = &(const char *){VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME}},
        NULL, &gpu->device);
    if (result < 0)
        return vk_fail(err, SPL_E_NO_DEVICE, result, "no device");
    vkGetDeviceQueue(gpu->device, gpu->family, 0, &gpu->queue);
    gpu->push_descriptors =
        (PFN_vkCmdPushDescriptorSetKHR)vkGetDeviceProcAddr(gpu->device, "vkCmdPushDescriptorSetKHR");
    return 0;
}

static int vk_open(uint32_t index, const struct spl_gpu_options *options, struct spl_gpu **out, struct spl_error *err)
{
    VkPhysicalDeviceProperties properties;
    bool atomics_64;
    struct vk_gpu *gpu = spl_alloc(1, sizeof *gpu, err);
    if (!gpu)
        return SPL_E_NOMEM;
    gpu->base.backend = &spl_gpu_vulkan;
    int code = vk_instance_take(options->debug, &gpu->instance, err);
    if (code < 0)
        goto failed;
    if (!vk_device_get(gpu->instance, index, &gpu->physical, &gpu->base.info, &gpu->family)) {
        code = spl_fail(err, SPL_E_NO_DEVICE, "vulkan: device %u has gone", index);
        goto failed;
    }
    if ((code = create_device(gpu, &atomics_64, err)) < 0)
        goto failed;
    read_limits(gpu, &properties, atomics_64);
    if ((code = vk_cache_load(gpu, &properties, options->cache_dir, err)) < 0 || (code = vk_frames_init(gpu, err)) < 0)
        goto failed;
    *out = &gpu->base;
    return 0;
failed:
    vk_close(&gpu->base);
    return code;
}

const struct spl_gpu_backend spl_gpu_vulkan = {
    .name = "vulkan",
    .list = vk_list,
    .open = vk_open,
    .close = vk_close,
    .buffer_create = vk_buffer_create,
    .buffer_destroy = vk_buffer_destroy,
    .kernel_create = vk_kernel_create,
    .kernel_destroy = vk_kernel_destroy,
    .begin = vk_begin,
    .dispatch = vk_dispatch,
    .barrier = vk_barrier,
    .copy = vk_copy,
    .fill = vk_fill,
    .timestamp = vk_timestamp,
    .submit = vk_submit,
    .wait = vk_wait,
    .read_timestamps = vk_read_timestamps,
};
