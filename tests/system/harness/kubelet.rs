//! Starts a pod of deploy/kubernetes without a cluster: its container's command, user, environment and files, as a kubelet makes them.
//!
//! A pod has a root file system and a network of its own. The root file system is read-only; it has the programs and libraries of this
//! machine, in place of the image's, and the pod's volumes. This needs Linux, root, util-linux and iproute2.

use super::server::program;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Objects of a cluster, as `kubectl apply` sends them.
pub(crate) struct Manifests {
    objects: Vec<Value>,
    /// Values of secrets and ConfigMaps, by the object's name.
    data: BTreeMap<String, BTreeMap<String, String>>,
}

/// A folder of the repository.
pub(crate) fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// The documents of a YAML file.
fn documents(text: &str) -> Vec<Value> {
    let documents = serde_yaml_ng::Deserializer::from_str(text);
    documents.map(|one| serde::Deserialize::deserialize(one).expect("YAML")).collect()
}

impl Manifests {
    /// The objects of a folder with a kustomization; None without kubectl, with the reason printed.
    pub(crate) fn of(folder: &str) -> Option<Self> {
        let Ok(built) = Command::new("kubectl").arg("kustomize").arg(repository(folder)).output() else {
            println!("SKIP {folder}: kubectl is not installed");
            return None;
        };
        assert!(built.status.success(), "{folder}: {}", String::from_utf8_lossy(&built.stderr));
        let objects = documents(&String::from_utf8(built.stdout).expect("UTF-8"));
        let mut data = BTreeMap::new();
        for object in &objects {
            for field in ["data", "stringData"] {
                let Some(values) = object[field].as_object() else { continue };
                let text = |value: &Value| value.as_str().expect("text").to_owned();
                let values = values.iter().map(|(name, value)| (name.clone(), text(value))).collect();
                data.insert(object["metadata"]["name"].as_str().expect("a name").to_owned(), values);
            }
        }
        Some(Manifests { objects, data })
    }

    /// The only object of a kind.
    pub(crate) fn object(&self, kind: &str) -> &Value {
        let mut of_kind = self.objects.iter().filter(|object| object["kind"] == kind);
        let found = of_kind.next().unwrap_or_else(|| panic!("no {kind}"));
        assert!(of_kind.next().is_none(), "several objects of the kind {kind}");
        found
    }

    /// The object of a kind and name.
    pub(crate) fn named(&self, kind: &str, name: &str) -> &Value {
        let is_it = |object: &&Value| object["kind"] == kind && object["metadata"]["name"] == name;
        self.objects.iter().find(is_it).unwrap_or_else(|| panic!("no {kind} {name}"))
    }

    /// Gives the files of a secret's volume other permissions.
    pub(crate) fn with_mode(&mut self, volume: &str, mode: u64) {
        let mut sets = self.objects.iter_mut().filter(|object| object["kind"] == "StatefulSet");
        let spec = &mut sets.next().expect("a set")["spec"]["template"]["spec"];
        let mut volumes = spec["volumes"].as_array_mut().expect("volumes").iter_mut();
        let found = volumes.find(|known| known["name"] == volume).expect("the volume");
        found["secret"]["defaultMode"] = mode.into();
    }

    /// As `kubectl create secret generic NAME --from-file=FOLDER`.
    pub(crate) fn create_secret(&mut self, name: &str, folder: &Path) {
        let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
        let value = |path: &Path| fs::read_to_string(path).expect("text");
        let values = entries
            .map(|entry| (entry.file_name().to_string_lossy().into_owned(), value(&entry.path())))
            .collect();
        self.data.insert(name.to_owned(), values);
    }

    /// Sets a value that an organizer puts in: one of a secret of the manifest.
    pub(crate) fn put_in(&mut self, secret: &str, name: &str, value: &str) {
        let values = self.data.get_mut(secret).unwrap_or_else(|| panic!("no secret {secret}"));
        assert!(values.insert(name.to_owned(), value.to_owned()).is_some(), "{secret} has no {name}");
    }

    fn values(&self, name: &Value) -> &BTreeMap<String, String> {
        let name = name.as_str().expect("a name");
        self.data.get(name).unwrap_or_else(|| panic!("no secret or ConfigMap {name}"))
    }

    /// Starts the pod with this number. `socket` is the folder of a database's socket; the pod has it in the same place.
    pub(crate) fn start(&self, number: u32, socket: &Path) -> Pod {
        let set = self.object("StatefulSet");
        let name = format!("{}-{number}", set["metadata"]["name"].as_str().expect("a name"));
        let template = &set["spec"]["template"];
        let spec = &template["spec"];
        let container = &spec["containers"][0];
        let folder = TempDir::new().expect("temporary directory");
        let script = Script::new(self, spec, container, socket, &name).text();
        let file = folder.path().join("start.sh");
        fs::write(&file, &script).expect("written");
        let log = fs::File::create(folder.path().join("log")).expect("a log");
        let mut command = Command::new("unshare");
        command
            .args(["--mount", "--net", "--", "bash"])
            .arg(&file)
            .arg(folder.path().join("root"))
            .arg(program());
        let output = log.try_clone().expect("a handle");
        let process = command.stdin(Stdio::null()).stdout(output).stderr(log).spawn().expect("unshare runs");
        Pod { process, folder, container: container.clone() }
    }
}

/// The reason why this machine starts no pods.
pub(crate) fn unable() -> Option<&'static str> {
    let works = |program: &str, words: &[&str]| {
        Command::new(program).args(words).output().is_ok_and(|output| output.status.success())
    };
    if !Command::new("id").arg("-u").output().is_ok_and(|id| id.stdout == b"0\n") {
        return Some("only root starts pods");
    }
    if !works("unshare", &["--mount", "--net", "--", "ip", "link", "set", "lo", "up"]) {
        return Some("no namespaces here, or no iproute2");
    }
    works("setpriv", &["--version"]).then_some(()).map_or(Some("setpriv is not installed"), |()| None)
}

/// The shell script that becomes the container's process. Its arguments: a folder for the root, the program.
struct Script {
    text: String,
}

/// A word for a shell.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// The permissions of a volume's files.
fn mode(volume: &Value) -> u64 {
    volume["defaultMode"].as_u64().unwrap_or(0o644)
}

impl Script {
    fn new(manifests: &Manifests, spec: &Value, container: &Value, socket: &Path, name: &str) -> Self {
        let security = &spec["securityContext"];
        let group = security["fsGroup"].as_u64();
        let mut script = Script { text: include_str!("pod_root.sh").to_owned() };
        script.line(&format!("mkdir -p \"$root\"{0} && mount --bind {0} \"$root\"{0}", socket.display()));
        for mount in container["volumeMounts"].as_array().expect("volumes") {
            let volumes = spec["volumes"].as_array().expect("volumes");
            let volume = volumes.iter().find(|volume| volume["name"] == mount["name"]).expect("a volume");
            script.volume(manifests, volume, mount["mountPath"].as_str().expect("a path"), group);
        }
        if container["securityContext"]["readOnlyRootFilesystem"] == true {
            script.line("mount -o remount,ro \"$root\"");
        }
        let image = Image::read();
        let mut words = vec!["exec chroot \"$root\" setpriv".to_owned()];
        let number = |field: &str| security[field].as_u64().map(|number| number.to_string());
        let user = number("runAsUser").unwrap_or(image.user.clone());
        if security["runAsNonRoot"] == true {
            assert_ne!(user, "0", "the kubelet refuses root");
        }
        let own_group = number("runAsGroup").unwrap_or("0".into());
        words.push(format!("--reuid {user} --regid {own_group}"));
        words.push(group.map_or("--clear-groups".to_owned(), |group| format!("--groups {group}")));
        words.push(capabilities(&container["securityContext"]));
        if container["securityContext"]["allowPrivilegeEscalation"] == false {
            words.push("--no-new-privs".into());
        }
        words.push("env --ignore-environment PATH=/image:/usr/bin:/bin".into());
        let environment = image.environment.into_iter().chain(environment(manifests, container, name));
        words.extend(environment.map(|(name, value)| quoted(&format!("{name}={value}"))));
        let own =
            |field: &str| -> Option<Vec<String>> { serde_json::from_value(container[field].clone()).ok() };
        let command = own("command").unwrap_or(image.entrypoint);
        words.extend(command.iter().chain(&own("args").unwrap_or(image.command)).map(|word| quoted(word)));
        script.line(&words.join(" "));
        script
    }

    fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    /// A volume, with owner, group and permissions as the kubelet sets them (kubernetes/pkg/volume/volume_linux.go): files of a pod with
    /// a group are readable by it, and writable unless the volume is read-only.
    fn volume(&mut self, manifests: &Manifests, volume: &Value, path: &str, group: Option<u64>) {
        let fields = volume.as_object().expect("a volume");
        let kind = fields.keys().find(|key| *key != "name").expect("its kind").as_str();
        let place = format!("\"$root\"{path}");
        self.line(&format!("mkdir -p {place} && mount -t tmpfs -o mode=777 pod {place}"));
        let source = match kind {
            "emptyDir" => None,
            "secret" => Some(&volume["secret"]["secretName"]),
            "configMap" => Some(&volume["configMap"]["name"]),
            other => panic!("a volume of the kind {other}"),
        };
        let of_group = if group.is_none() {
            0
        } else if source.is_some() {
            0o440
        } else {
            0o660
        };
        if let Some(name) = source {
            let mode = mode(&volume[kind]) | of_group;
            // A volume is replaced as a whole: the names are links into a folder that is a link itself.
            self.line(&format!("mkdir {place}/..2027 && ln -s ..2027 {place}/..data"));
            for (file, value) in manifests.values(name) {
                self.line(&format!("printf %s {} > {place}/..2027/{file}", quoted(value)));
                self.line(&format!(
                    "chmod {mode:o} {place}/..2027/{file} && ln -s ..data/{file} {place}/{file}"
                ));
            }
        }
        if let Some(group) = group {
            self.line(&format!(
                "chown -R --no-dereference :{group} {place} && find {place} -type d -exec chmod g+rwxs {{}} +"
            ));
        }
        if source.is_some() {
            self.line(&format!("mount -o remount,ro {place}"));
        }
    }

    fn text(self) -> String {
        self.text
    }
}

/// The arguments of setpriv for a container's capabilities. Root has those of the list, other users none.
fn capabilities(security: &Value) -> String {
    let dropped = security["capabilities"]["drop"] == serde_json::json!(["ALL"]);
    assert!(dropped, "the container keeps the usual capabilities: {security}");
    let none: Vec<Value> = Vec::new();
    let added = security["capabilities"]["add"].as_array().unwrap_or(&none);
    let added = added.iter().map(|name| format!(",+{}", name.as_str().expect("a name").to_lowercase()));
    format!("--inh-caps=-all --bounding-set=-all{}", added.collect::<String>())
}

/// The variables of the container.
fn environment(manifests: &Manifests, container: &Value, name: &str) -> Vec<(String, String)> {
    let mut variables: Vec<(String, String)> = Vec::new();
    for source in container["envFrom"].as_array().into_iter().flatten() {
        variables.extend(manifests.values(&source["secretRef"]["name"]).clone());
    }
    for variable in container["env"].as_array().into_iter().flatten() {
        let mut value = match (&variable["value"], &variable["valueFrom"]["fieldRef"]["fieldPath"]) {
            (Value::String(value), _) => value.clone(),
            (_, Value::String(path)) if path == "metadata.name" => name.to_owned(),
            (_, Value::String(path)) if path == "status.podIP" => "127.0.0.1".to_owned(),
            _ => panic!("a variable {variable}"),
        };
        for (name, known) in &variables {
            value = value.replace(&format!("$({name})"), known);
        }
        variables.push((variable["name"].as_str().expect("a name").to_owned(), value));
    }
    variables
}

/// The image that the Dockerfile makes: what a container of it starts.
struct Image {
    user: String,
    environment: Vec<(String, String)>,
    entrypoint: Vec<String>,
    command: Vec<String>,
}

impl Image {
    fn read() -> Self {
        let text = fs::read_to_string(repository("Dockerfile")).expect("the Dockerfile");
        let line = |name: &str| {
            let mut lines = text.lines().filter_map(|line| line.strip_prefix(name));
            lines.next().unwrap_or_else(|| panic!("the Dockerfile has no {name}")).to_owned()
        };
        let words = |name| serde_json::from_str(&line(name)).expect("a list");
        let pair = |word: &str| word.split_once('=').map(|(name, value)| (name.into(), value.into()));
        Image {
            user: line("USER ").split(':').next().unwrap_or_default().to_owned(),
            environment: line("ENV ").split(' ').filter_map(pair).collect(),
            entrypoint: words("ENTRYPOINT "),
            command: words("CMD "),
        }
    }
}

/// A running pod. Dropping it kills it.
pub(crate) struct Pod {
    process: Child,
    folder: TempDir,
    container: Value,
}

impl Pod {
    /// Waits until its probes succeed, in their order and within their budgets.
    pub(crate) fn ready(&mut self) {
        for kind in ["startupProbe", "readinessProbe", "livenessProbe"] {
            let probe: Map<String, Value> = self.container[kind].as_object().expect(kind).clone();
            assert_eq!(probe["httpGet"]["port"], self.container["ports"][0]["name"]);
            let path = probe["httpGet"]["path"].as_str().expect("a path").to_owned();
            let number = |field: &str| probe[field].as_u64().expect(field);
            let budget = Duration::from_secs(number("periodSeconds") * number("failureThreshold"));
            // A pod that has started becomes ready when it is; only the start has a time limit.
            let budget = if kind == "startupProbe" { budget } else { budget.max(Duration::from_secs(60)) };
            let began = Instant::now();
            while !self.answers(&path) {
                let ended = self.process.try_wait().expect("its state");
                assert!(ended.is_none() && began.elapsed() < budget, "{kind}: {ended:?}\n{}", self.log());
                std::thread::sleep(Duration::from_millis(100));
            }
        }
    }

    /// Whether `GET path` is answered with 200.
    fn answers(&self, path: &str) -> bool {
        let port = &self.container["ports"][0]["containerPort"];
        let ask = format!(
            "exec 3<>/dev/tcp/127.0.0.1/{port} && printf 'GET {path} HTTP/1.0\\r\\nHost: 127.0.0.1\\r\\n\\r\\n' >&3 \
             && head -n 1 <&3"
        );
        let answer = self.inside("--net").args(["bash", "-c", &ask]).output().expect("nsenter runs");
        String::from_utf8_lossy(&answer.stdout).contains(" 200 ")
    }

    /// A command with the pod's network (`--net`), or in its container as root (`--all`).
    fn inside(&self, what: &str) -> Command {
        let mut command = Command::new("nsenter");
        command.arg("--target").arg(self.process.id().to_string()).arg("--net");
        if what == "--all" {
            command.args(["--mount", "--root", "--wd"]);
        }
        command.arg("--");
        command
    }

    /// `palmares admin` at the pod's server, with the organizer's token of a file outside.
    pub(crate) fn admin(&self, token: &Path, words: &[&str]) -> Output {
        let mut command = self.inside("--net");
        command.arg(program()).args(["admin", "--token-file"]).arg(token).args(words);
        command.env("PALMARES_URL", "http://127.0.0.1:8080").output().expect("palmares runs")
    }

    /// The output of `sh -c` in the container.
    pub(crate) fn shell(&self, line: &str) -> String {
        let output = self.inside("--all").args(["/bin/sh", "-c", line]).output().expect("nsenter runs");
        let both = [output.stdout, output.stderr].concat();
        String::from_utf8_lossy(&both).trim().to_owned()
    }

    /// A line of the process's state: `Uid:`, `CapEff:`.
    pub(crate) fn status(&self, field: &str) -> Vec<String> {
        let text = fs::read_to_string(format!("/proc/{}/status", self.process.id())).expect("it runs");
        let line = text.lines().find_map(|line| line.strip_prefix(field)).expect("the field");
        line.split_whitespace().map(str::to_owned).collect()
    }

    /// The scheduling policies of its threads.
    pub(crate) fn policies(&self) -> Vec<u64> {
        let tasks = fs::read_dir(format!("/proc/{}/task", self.process.id())).expect("it runs");
        let policy = |path: PathBuf| -> Option<u64> {
            let stat = fs::read_to_string(path.join("stat")).ok()?;
            // Field 41, counted from the one after the name in parentheses.
            stat.rsplit_once(") ")?.1.split(' ').nth(38)?.parse().ok()
        };
        tasks.filter_map(|task| policy(task.ok()?.path())).collect()
    }

    /// Its output so far.
    pub(crate) fn log(&self) -> String {
        fs::read_to_string(self.folder.path().join("log")).unwrap_or_default()
    }

    /// How it ended by itself.
    pub(crate) fn ended(&mut self) -> String {
        let status = self.process.wait().expect("it ends");
        format!("{status}\n{}", self.log())
    }
}

impl Drop for Pod {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
