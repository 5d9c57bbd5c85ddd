/* Pipelines, and their cache on disk: one file per device and driver, written to a temporary name and renamed, so that
 * a crash or two processes at once never leave half a file. A file that is not ours, or not whole, is ignored. Owned by
 * the device's thread. */
#include "gpu/vulkan/vk.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"

/* No driver's cache of a dozen kernels comes near this; a file beyond it is not one. */
enum { CACHE_BYTES_MAX = 64 << 20 };

/* Storage buffers, then texels, pushed with each dispatch. */
static VkResult create_layout(struct vk_gpu *gpu, const struct spl_gpu_code *code, struct vk_kernel *kernel)
{
    VkDescriptorSetLayoutBinding bindings[2 * SPL_GPU_BOUND_MAX];
    uint32_t count = code->storages.count + code->texels.count;
    for (uint32_t i = 0; i < count; i++)
        bindings[i] = (VkDescriptorSetLayoutBinding){.binding = i,
                                                     .descriptorType = i < code->storages.count
                                                                           ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER
                                                                           : VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER,
                                                     .descriptorCount = 1,
                                                     .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT};
    VkResult result = vkCreateDescriptorSetLayout(
        gpu->device,
        &(VkDescriptorSetLayoutCreateInfo){.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                           .flags = VK_DESCRIPTOR_SET_LAYOUT_CREATE_PUSH_DESCRIPTOR_BIT_KHR,
                                           .bindingCount = count,
                                           .pBindings = bindings},
        NULL, &kernel->set_layout);
    return result < 0 ? result
                      : vkCreatePipelineLayout(gpu->device,
                                               &(VkPipelineLayoutCreateInfo){
                                                   .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                                   .setLayoutCount = 1,
                                                   .pSetLayouts = &kernel->set_layout},
                                               NULL, &kernel->layout);
}

int vk_kernel_create(struct spl_gpu *base, const struct spl_gpu_code *code, const uint32_t *constants,
                     size_t constant_count, struct spl_gpu_kernel **out, struct spl_error *err)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    struct vk_kernel *kernel = spl_alloc(1, sizeof *kernel, err);
    if (!kernel)
        return SPL_E_NOMEM;
    VkSpecializationMapEntry entries[SPL_GPU_CONSTANTS_MAX];
    for (uint32_t i = 0; i < constant_count; i++)
        entries[i] = (VkSpecializationMapEntry){.constantID = i, .offset = 4 * i, .size = 4};
    VkSpecializationInfo specialization = {.mapEntryCount = (uint32_t)constant_count,
                                           .pMapEntries = entries,
                                           .dataSize = 4 * constant_count,
                                           .pData = constants};
    VkShaderModule module = VK_NULL_HANDLE;
    VkResult result = create_layout(gpu, code, kernel);
    if (result >= 0)
        result = vkCreateShaderModule(gpu->device,
                                           &(VkShaderModuleCreateInfo){
                                               .sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                               .codeSize = 4 * (size_t)(code->vulkan.end - code->vulkan.begin),
                                               .pCode = code->vulkan.begin},
                                           NULL, &module);
    if (result >= 0)
        result = vkCreateComputePipelines(
            gpu->device, gpu->cache, 1,
            &(VkComputePipelineCreateInfo){
                .sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
                .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                          .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                          .module = module,
                          .pName = "main",
                          .pSpecializationInfo = &specialization},
                .layout = kernel->layout},
            NULL, &kernel->pipeline);
    vkDestroyShaderModule(gpu->device, module, NULL);
    if (result < 0) {
        char what[128];
        snprintf(what, sizeof what, "kernel '%s' was refused", code->name);
        vk_kernel_destroy(base, &kernel->base);
        return vk_fail(err, SPL_E_UNSUPPORTED, result, what);
    }
    *out = &kernel->base;
    return 0;
}

void vk_kernel_destroy(struct spl_gpu *base, struct spl_gpu_kernel *base_kernel)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    struct vk_kernel *kernel = (struct vk_kernel *)base_kernel;
    vkDestroyPipeline(gpu->device, kernel->pipeline, NULL);
    vkDestroyPipelineLayout(gpu->device, kernel->layout, NULL);
    vkDestroyDescriptorSetLayout(gpu->device, kernel->set_layout, NULL);
    free(kernel);
}

/* Makes `path` and its parents as far as they are missing; failure shows when the file is written. */
static void make_folders(char *path)
{
    for (char *slash = strchr(path + 1, '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        mkdir(path, 0700);
        *slash = '/';
    }
}

static void set_path(struct vk_gpu *gpu, const VkPhysicalDeviceProperties *properties, const char *folder)
{
    char own[3072] = "";
    const char *xdg = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    if (!folder) {
        if (xdg && xdg[0] == '/')
            snprintf(own, sizeof own, "%s/splatd", xdg);
        else if (home && home[0] == '/')
            snprintf(own, sizeof own, "%s/.cache/splatd", home);
        folder = own;
    }
    if (!folder[0])
        return;
    int used = snprintf(gpu->cache_path, sizeof gpu->cache_path, "%s/pipelines-%04x-%04x-%08x-", folder,
                        properties->vendorID, properties->deviceID, properties->driverVersion);
    for (size_t i = 0; used > 0 && i < VK_UUID_SIZE && (size_t)used + 3 < sizeof gpu->cache_path; i++)
        used += snprintf(gpu->cache_path + used, 3, "%02x", properties->pipelineCacheUUID[i]);
    if (used < 0 || (size_t)used + 16 > sizeof gpu->cache_path)
        gpu->cache_path[0] = '\0';
}

/* The file's bytes when its header is this device's, else NULL. Drivers check the header too, but a file of another
 * driver or a torn one is cheaper to refuse than to trust. */
static void *read_cache(const char *path, const VkPhysicalDeviceProperties *properties, size_t *bytes)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return NULL;
    struct stat status;
    VkPipelineCacheHeaderVersionOne header;
    char *data = NULL;
    if (!fstat(fileno(file), &status) && status.st_size >= (off_t)sizeof header && status.st_size <= CACHE_BYTES_MAX &&
        (data = spl_alloc_raw((size_t)status.st_size, 1, NULL)) != NULL) {
        *bytes = fread(data, 1, (size_t)status.st_size, file);
        memcpy(&header, data, sizeof header);
        if (*bytes != (size_t)status.st_size || header.headerVersion != VK_PIPELINE_CACHE_HEADER_VERSION_ONE ||
            header.vendorID != properties->vendorID || header.deviceID != properties->deviceID ||
            memcmp(header.pipelineCacheUUID, properties->pipelineCacheUUID, VK_UUID_SIZE)) {
            free(data);
            data = NULL;
        }
    }
    fclose(file);
    return data;
}

int vk_cache_load(struct vk_gpu *gpu, const VkPhysicalDeviceProperties *properties, const char *folder,
                  struct spl_error *err)
{
    set_path(gpu, properties, folder);
    void *data = gpu->cache_path[0] ? read_cache(gpu->cache_path, properties, &gpu->cache_loaded) : NULL;
    VkPipelineCacheCreateInfo info = {.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO,
                                      .initialDataSize = data ? gpu->cache_loaded : 0,
                                      .pInitialData = data};
    if (!data)
        gpu->cache_loaded = 0;
    VkResult result = vkCreatePipelineCache(gpu->device, &info, NULL, &gpu->cache);
    free(data);
    return result < 0 ? vk_fail(err, SPL_E_NO_DEVICE, result, "no pipeline cache") : 0;
}

/* A cache that cannot be written costs time at the next start, nothing else: no error. */
void vk_cache_save(struct vk_gpu *gpu)
{
    size_t bytes = 0;
    if (!gpu->cache || !gpu->cache_path[0] || vkGetPipelineCacheData(gpu->device, gpu->cache, &bytes, NULL) < 0 ||
        bytes == gpu->cache_loaded || bytes > CACHE_BYTES_MAX)
        return;
    void *data = spl_alloc_raw(bytes, 1, NULL);
    if (data && vkGetPipelineCacheData(gpu->device, gpu->cache, &bytes, data) == VK_SUCCESS) {
        make_folders(gpu->cache_path);
        spl_file_replace(gpu->cache_path, data, bytes, NULL);
    }
    free(data);
}
