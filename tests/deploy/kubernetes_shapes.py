"""The fields of Kubernetes' objects that deploy/kubernetes uses, as JSON Schema that knows no others: a field that is
mistyped, or new, is refused until it has its place here. The names are Kubernetes' and the Prometheus operator's."""


def text(*choices):
    return {"enum": list(choices)} if choices else {"type": "string", "minLength": 1}


def items(shape):
    return {"type": "array", "items": shape, "minItems": 1}


def obj(*required, **fields):
    return {"type": "object", "properties": fields, "required": list(required), "additionalProperties": False}


S, I, B = text(), {"type": "integer", "minimum": 0}, {"type": "boolean"}
QUANTITY = {"type": "string", "pattern": r"^\d+(m|Ki|Mi|Gi|Ti)?$"}
NAME = {"type": "string", "pattern": r"^[a-z0-9]([a-z0-9-]{0,61}[a-z0-9])?$"}
PORT = {"type": "string", "pattern": r"^[a-z]([a-z0-9-]{0,13}[a-z0-9])?$"}  # by name, everywhere but where it is made
LABELS = {"type": "object", "additionalProperties": S, "minProperties": 1}
SELECTOR = obj("matchLabels", matchLabels=LABELS)
META = obj("name", name=NAME, labels=LABELS, annotations=LABELS)
QUANTITIES = {"type": "object", "additionalProperties": QUANTITY,
              "propertyNames": {"enum": ["cpu", "memory", "storage", "nvidia.com/gpu"]}}
PROBE = obj("httpGet", httpGet=obj("path", "port", path=S, port=PORT), periodSeconds=I, timeoutSeconds=I,
            failureThreshold=I)
CONTAINER = obj(
    "name", "image", "args", "ports", "startupProbe", "readinessProbe", "livenessProbe", "securityContext",
    "volumeMounts", "resources", name=NAME, image=S, args=items(S),
    ports=items(obj("name", "containerPort", name=PORT, containerPort=I)),
    startupProbe=PROBE, readinessProbe=PROBE, livenessProbe=PROBE,
    resources=obj(requests=QUANTITIES, limits=QUANTITIES),
    securityContext=obj("allowPrivilegeEscalation", "readOnlyRootFilesystem", "capabilities",
                        allowPrivilegeEscalation=B, readOnlyRootFilesystem=B,
                        capabilities=obj("drop", drop=items(text("ALL")))),
    volumeMounts=items(obj("name", "mountPath", name=NAME, mountPath=S, subPath=S, readOnly=B)))
VOLUME = obj("name", name=NAME, configMap=obj("name", name=NAME),
             secret=obj("secretName", secretName=NAME, defaultMode=I),
             persistentVolumeClaim=obj("claimName", claimName=NAME), emptyDir=obj(sizeLimit=QUANTITY),
             hostPath=obj("path", "type", path=S, type=text("Directory")))
POD = obj(
    "containers", "volumes", "securityContext", "terminationGracePeriodSeconds", automountServiceAccountToken=B,
    enableServiceLinks=B, terminationGracePeriodSeconds=I,
    securityContext=obj("runAsNonRoot", "runAsUser", "seccompProfile", runAsNonRoot=B, runAsUser=I, runAsGroup=I,
                        fsGroup=I, fsGroupChangePolicy=text("OnRootMismatch", "Always"),
                        seccompProfile=obj("type", type=text("RuntimeDefault"))),
    topologySpreadConstraints=items(obj(
        "maxSkew", "topologyKey", "whenUnsatisfiable", "labelSelector", maxSkew=I, labelSelector=SELECTOR,
        topologyKey=text("kubernetes.io/hostname", "topology.kubernetes.io/zone"),
        whenUnsatisfiable=text("ScheduleAnyway", "DoNotSchedule"))),
    tolerations=items(obj(key=S, operator=text("Exists", "Equal"), effect=text("NoSchedule", "NoExecute"))),
    runtimeClassName=NAME, containers=items(CONTAINER), volumes=items(VOLUME))
FIELD = obj("fieldPath", fieldPath=text("metadata.annotations['batch.kubernetes.io/job-completion-index']"))
WORKER = obj(  # a container that ends by itself, and its pod
    "name", "image", "args", "securityContext", "volumeMounts", "resources", name=NAME, image=S, args=items(S),
    env=items(obj("name", "valueFrom", name=S, valueFrom=obj("fieldRef", fieldRef=FIELD))),
    **{field: CONTAINER["properties"][field] for field in ("securityContext", "volumeMounts", "resources")})
TASK = obj(
    "restartPolicy", "containers", "volumes", "securityContext", restartPolicy=text("OnFailure", "Never"),
    containers=items(WORKER),
    **{field: POD["properties"][field] for field in ("automountServiceAccountToken", "enableServiceLinks",
                                                     "securityContext", "volumes")})
POLICIES = obj(stabilizationWindowSeconds=I,
               policies=items(obj("type", "value", "periodSeconds", type=text("Percent", "Pods"), value=I,
                                  periodSeconds=I)))
PEER = obj(namespaceSelector=SELECTOR, podSelector={"anyOf": [SELECTOR, {"const": {}}]})

SPECS = {
    ("apps/v1", "Deployment"): obj(
        "selector", "template", "strategy", revisionHistoryLimit=I, selector=SELECTOR,
        strategy=obj("type", type=text("RollingUpdate"), rollingUpdate=obj(maxSurge=I, maxUnavailable=I)),
        template=obj("metadata", "spec", metadata=obj("labels", labels=LABELS), spec=POD)),
    ("batch/v1", "Job"): obj(
        "completionMode", "completions", "template", completionMode=text("Indexed"), completions=I, parallelism=I,
        backoffLimit=I, template=obj("metadata", "spec", metadata=obj("labels", labels=LABELS), spec=TASK)),
    ("v1", "Service"): obj("selector", "ports", selector=LABELS, clusterIP=text("None"), publishNotReadyAddresses=B,
                           ports=items(obj("name", "port", "targetPort", name=PORT, port=I, targetPort=PORT))),
    ("v1", "PersistentVolumeClaim"): obj(
        "accessModes", "resources", accessModes=items(text("ReadWriteMany", "ReadOnlyMany")),
        resources=obj("requests", requests=QUANTITIES), storageClassName=NAME),
    ("autoscaling/v2", "HorizontalPodAutoscaler"): obj(
        "scaleTargetRef", "minReplicas", "maxReplicas", "metrics", minReplicas=I, maxReplicas=I,
        scaleTargetRef=obj("apiVersion", "kind", "name", apiVersion=S, kind=S, name=NAME),
        metrics=items(obj("type", "pods", type=text("Pods"), pods=obj(
            "metric", "target", metric=obj("name", name=S),
            target=obj("type", "averageValue", type=text("AverageValue"), averageValue=QUANTITY)))),
        behavior=obj(scaleUp=POLICIES, scaleDown=POLICIES)),
    ("policy/v1", "PodDisruptionBudget"): obj("maxUnavailable", "selector", maxUnavailable=I, selector=SELECTOR),
    ("networking.k8s.io/v1", "NetworkPolicy"): obj(
        "podSelector", "policyTypes", podSelector=SELECTOR, policyTypes=items(text("Ingress", "Egress")),
        ingress=items(obj("from", "ports", ports=items(obj("protocol", "port", protocol=text("TCP"), port=PORT)),
                          **{"from": items(PEER)})), egress={"const": []}),
    ("networking.k8s.io/v1", "Ingress"): obj("ingressClassName", "rules", ingressClassName=NAME, rules=items(obj(
        "host", "http", host=S, http=obj("paths", paths=items(obj(
            "path", "pathType", "backend", path=S, pathType=text("Prefix"), backend=obj("service", service=obj(
                "name", "port", name=NAME, port=obj("name", name=PORT))))))))),
    ("monitoring.coreos.com/v1", "ServiceMonitor"): obj(
        "selector", "endpoints", jobLabel=S, selector=SELECTOR,
        endpoints=items(obj("port", "path", "interval", port=PORT, path=S,
                            interval={"type": "string", "pattern": r"^\d+s$"}))),
}


def shape_of(document):
    """The schema of a whole object; KeyError for a kind that is not known in that version."""
    kind = document["apiVersion"], document["kind"]
    if kind == ("v1", "ConfigMap"):
        return obj("metadata", "data", apiVersion=S, kind=S, metadata=META, data=LABELS)
    return obj("metadata", "spec", apiVersion=S, kind=S, metadata=META, spec=SPECS[kind])
