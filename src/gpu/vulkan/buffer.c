/* One allocation per buffer: buffers are few, large and live long, so nothing is suballocated. Host-visible buffers
 * stay mapped and are coherent. Owned by the device's thread. */
#include "gpu/vulkan/vk.h"

#include <inttypes.h>
#include <stdlib.h>

#include "base/memory.h"

/* Property masks in order of preference; each ends with one that every implementation has. */
static const VkMemoryPropertyFlags wanted[][3] = {
    [SPL_GPU_DEVICE] = {VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0},
    [SPL_GPU_UPLOAD] = {VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT},
    [SPL_GPU_READBACK] = {VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT |
                              VK_MEMORY_PROPERTY_HOST_CACHED_BIT,
                          VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT},
};

/* Parameters and draw lists are read by every thread, so small uploads go where the device reads fastest; the window of
 * such memory may be as small as 256 MiB, so large ones do not. */
enum { SMALL_UPLOAD_BYTES = 1 << 20 };

static int find_type(const struct vk_gpu *gpu, uint32_t allowed, VkMemoryPropertyFlags flags)
{
    for (uint32_t i = 0; i < gpu->memory.memoryTypeCount; i++)
        if (allowed >> i & 1 && (gpu->memory.memoryTypes[i].propertyFlags & flags) == flags)
            return (int)i;
    return -1;
}

static int choose_type(const struct vk_gpu *gpu, enum spl_gpu_buffer_kind kind, uint64_t bytes, uint32_t allowed)
{
    int type = -1;
    if (kind == SPL_GPU_UPLOAD && bytes <= SMALL_UPLOAD_BYTES)
        type = find_type(gpu, allowed, wanted[kind][0] | VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    for (size_t i = 0; type < 0 && i < 3 && (i == 0 || wanted[kind][i - 1]); i++)
        type = find_type(gpu, allowed, wanted[kind][i]);
    return type;
}

int vk_buffer_create(struct spl_gpu *base, enum spl_gpu_buffer_kind kind, uint64_t bytes, struct spl_gpu_buffer **out,
                     struct spl_error *err)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    struct vk_buffer *buffer = spl_alloc(1, sizeof *buffer, err);
    if (!buffer)
        return SPL_E_NOMEM;
    const char *step = "no buffer";
    VkResult result = vkCreateBuffer(gpu->device,
                                     &(VkBufferCreateInfo){.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
                                                           .size = bytes,
                                                           .usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT |
                                                                    VK_BUFFER_USAGE_STORAGE_TEXEL_BUFFER_BIT |
                                                                    VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                                                                    VK_BUFFER_USAGE_TRANSFER_DST_BIT},
                                     NULL, &buffer->buffer);
    if (result < 0)
        goto failed;
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(gpu->device, buffer->buffer, &needs);
    int type = choose_type(gpu, kind, bytes, needs.memoryTypeBits);
    step = "no memory for a buffer";
    result = VK_ERROR_OUT_OF_DEVICE_MEMORY;
    if (type >= 0)
        result = vkAllocateMemory(gpu->device,
                                  &(VkMemoryAllocateInfo){.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                                          .allocationSize = needs.size,
                                                          .memoryTypeIndex = (uint32_t)type},
                                  NULL, &buffer->memory);
    if (result < 0)
        goto failed;
    result = vkBindBufferMemory(gpu->device, buffer->buffer, buffer->memory, 0);
    if (result >= 0 && kind != SPL_GPU_DEVICE)
        result = vkMapMemory(gpu->device, buffer->memory, 0, VK_WHOLE_SIZE, 0, &buffer->base.map);
    if (result >= 0 && bytes <= gpu->base.limits.binding_bytes)
        result = vkCreateBufferView(gpu->device,
                                    &(VkBufferViewCreateInfo){.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO,
                                                              .buffer = buffer->buffer,
                                                              .format = VK_FORMAT_R32_UINT,
                                                              .range = bytes / 4 * 4},
                                    NULL, &buffer->texels);
    if (result < 0)
        goto failed;
    *out = &buffer->base;
    return 0;
failed:
    if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY)
        spl_fail(err, SPL_E_LIMIT, "vulkan: device '%s' refused %" PRIu64 " bytes beside the %" PRIu64
                 " bytes already taken", base->info.name, bytes, base->memory);
    int code = vk_fail(err, SPL_E_LIMIT, result, step);
    vk_buffer_destroy(base, &buffer->base);
    return code;
}

void vk_buffer_destroy(struct spl_gpu *base, struct spl_gpu_buffer *base_buffer)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    struct vk_buffer *buffer = (struct vk_buffer *)base_buffer;
    vkDestroyBufferView(gpu->device, buffer->texels, NULL);
    vkDestroyBuffer(gpu->device, buffer->buffer, NULL);
    vkFreeMemory(gpu->device, buffer->memory, NULL);
    free(buffer);
}
