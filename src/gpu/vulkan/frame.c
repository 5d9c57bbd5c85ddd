/* Recording, submission and waiting. A timeline semaphore carries the ticket of the last list that ended, so waiting
 * needs no other state. Owned by the device's thread. */
#include "gpu/vulkan/vk.h"

int vk_frames_init(struct vk_gpu *gpu, struct spl_error *err)
{
    VkResult result = vkCreateSemaphore(
        gpu->device,
        &(VkSemaphoreCreateInfo){.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO,
                                 .pNext = &(VkSemaphoreTypeCreateInfo){
                                     .sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
                                     .semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE}},
        NULL, &gpu->timeline);
    struct vk_list *list = &gpu->list;
    if (result >= 0)
        result = vkCreateCommandPool(gpu->device,
                                     &(VkCommandPoolCreateInfo){.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                                                .queueFamilyIndex = gpu->family},
                                     NULL, &list->pool);
    if (result >= 0)
        result = vkAllocateCommandBuffers(
            gpu->device,
            &(VkCommandBufferAllocateInfo){.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                           .commandPool = list->pool,
                                           .commandBufferCount = 1},
            &list->commands);
    if (result >= 0 && gpu->base.limits.timestamps)
        result = vkCreateQueryPool(gpu->device,
                                   &(VkQueryPoolCreateInfo){.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO,
                                                            .queryType = VK_QUERY_TYPE_TIMESTAMP,
                                                            .queryCount = SPL_GPU_TIMESTAMPS_MAX},
                                   NULL, &list->queries);
    return result < 0 ? vk_fail(err, SPL_E_NO_DEVICE, result, "no command buffers") : 0;
}

void vk_frames_finish(struct vk_gpu *gpu)
{
    vkDestroyCommandPool(gpu->device, gpu->list.pool, NULL);
    vkDestroyQueryPool(gpu->device, gpu->list.queries, NULL);
    vkDestroySemaphore(gpu->device, gpu->timeline, NULL);
}

void vk_barrier(struct spl_gpu *base)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    const VkPipelineStageFlags2 work = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;
    VkMemoryBarrier2 barrier = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
        .srcStageMask = work,
        .srcAccessMask = VK_ACCESS_2_MEMORY_WRITE_BIT,
        .dstStageMask = work | VK_PIPELINE_STAGE_2_HOST_BIT,
        .dstAccessMask = VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT,
    };
    vkCmdPipelineBarrier2(gpu->list.commands, &(VkDependencyInfo){.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO,
                                                                   .memoryBarrierCount = 1,
                                                                   .pMemoryBarriers = &barrier});
}

int vk_begin(struct spl_gpu *base, struct spl_error *err)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    struct vk_list *list = &gpu->list;
    VkResult result = vkResetCommandPool(gpu->device, list->pool, 0);
    if (result >= 0)
        result = vkBeginCommandBuffer(list->commands, &(VkCommandBufferBeginInfo){
                                                          .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                                          .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT});
    if (result < 0)
        return vk_fail(err, SPL_E_DEVICE_LOST, result, "a command buffer cannot begin");
    list->written = 0;
    if (list->queries)
        vkCmdResetQueryPool(list->commands, list->queries, 0, SPL_GPU_TIMESTAMPS_MAX);
    vk_barrier(base); /* behind the list before */
    return 0;
}

void vk_dispatch(struct spl_gpu *base, struct spl_gpu_kernel *base_kernel, const struct spl_gpu_arguments *arguments,
                 uint32_t workgroups)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    const struct vk_kernel *kernel = (const struct vk_kernel *)base_kernel;
    const struct spl_gpu_code *code = kernel->base.code;
    VkCommandBuffer commands = gpu->list.commands;
    VkDescriptorBufferInfo ranges[SPL_GPU_BOUND_MAX];
    VkBufferView views[SPL_GPU_BOUND_MAX];
    VkWriteDescriptorSet writes[2 * SPL_GPU_BOUND_MAX];
    uint32_t count = 0;
    for (uint32_t i = 0; i < code->storages.count; i++) {
        const struct spl_gpu_binding *binding = &arguments->storage[i];
        ranges[i] = (VkDescriptorBufferInfo){((const struct vk_buffer *)binding->buffer)->buffer, binding->offset,
                                             binding->bytes};
        writes[count] = (VkWriteDescriptorSet){.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                               .dstBinding = count,
                                               .descriptorCount = 1,
                                               .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
                                               .pBufferInfo = &ranges[i]};
        count++;
    }
    for (uint32_t i = 0; i < code->texels.count; i++) {
        views[i] = ((const struct vk_buffer *)arguments->texels[i])->texels;
        spl_assert(views[i]);
        writes[count] = (VkWriteDescriptorSet){.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                               .dstBinding = count,
                                               .descriptorCount = 1,
                                               .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER,
                                               .pTexelBufferView = &views[i]};
        count++;
    }
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel->pipeline);
    gpu->push_descriptors(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel->layout, 0, count, writes);
    vkCmdDispatch(commands, workgroups, 1, 1);
}

void vk_copy(struct spl_gpu *base, struct spl_gpu_buffer *from, uint64_t from_offset, struct spl_gpu_buffer *to,
             uint64_t to_offset, uint64_t bytes)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    vkCmdCopyBuffer(gpu->list.commands, ((struct vk_buffer *)from)->buffer, ((struct vk_buffer *)to)->buffer, 1,
                    &(VkBufferCopy){from_offset, to_offset, bytes});
}

void vk_fill(struct spl_gpu *base, struct spl_gpu_buffer *buffer, uint64_t offset, uint64_t bytes, uint32_t word)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    vkCmdFillBuffer(gpu->list.commands, ((struct vk_buffer *)buffer)->buffer, offset, bytes, word);
}

void vk_timestamp(struct spl_gpu *base, uint32_t slot)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    if (gpu->list.written >> slot & 1)
        return; /* a query may be written once between resets; the first stays */
    gpu->list.written |= 1u << slot;
    vkCmdWriteTimestamp2(gpu->list.commands, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, gpu->list.queries, slot);
}

int vk_submit(struct spl_gpu *base, uint64_t ticket, struct spl_error *err)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    vk_barrier(base);
    VkResult result = vkEndCommandBuffer(gpu->list.commands);
    if (result >= 0)
        result = vkQueueSubmit2(
            gpu->queue, 1,
            &(VkSubmitInfo2){
                .sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2,
                .commandBufferInfoCount = 1,
                .pCommandBufferInfos =
                    &(VkCommandBufferSubmitInfo){.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO,
                                                 .commandBuffer = gpu->list.commands},
                .signalSemaphoreInfoCount = 1,
                .pSignalSemaphoreInfos =
                    &(VkSemaphoreSubmitInfo){.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                                             .semaphore = gpu->timeline,
                                             .value = ticket,
                                             .stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT}},
            VK_NULL_HANDLE);
    return result < 0 ? vk_fail(err, SPL_E_DEVICE_LOST, result, "work was refused") : 0;
}

int vk_wait(struct spl_gpu *base, uint64_t ticket, uint64_t timeout_ns, struct spl_error *err)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    VkResult result = vkWaitSemaphores(gpu->device,
                                       &(VkSemaphoreWaitInfo){.sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO,
                                                              .semaphoreCount = 1,
                                                              .pSemaphores = &gpu->timeline,
                                                              .pValues = &ticket},
                                       timeout_ns);
    if (result == VK_TIMEOUT)
        return spl_fail(err, SPL_E_TIMEOUT, "device '%s' did not end its work in time", base->info.name);
    return result < 0 ? vk_fail(err, SPL_E_DEVICE_LOST, result, "waiting failed") : 0;
}

void vk_read_timestamps(struct spl_gpu *base)
{
    struct vk_gpu *gpu = (struct vk_gpu *)base;
    const struct vk_list *list = &gpu->list;
    for (uint32_t i = 0; i < SPL_GPU_TIMESTAMPS_MAX; i++) {
        uint64_t ticks = 0;
        if (list->written >> i & 1 &&
            vkGetQueryPoolResults(gpu->device, list->queries, i, 1, sizeof ticks, &ticks, sizeof ticks,
                                  VK_QUERY_RESULT_64_BIT) == VK_SUCCESS)
            base->timestamps_ns[i] = (uint64_t)((double)(ticks & gpu->timestamp_mask) * gpu->timestamp_period_ns);
    }
}
